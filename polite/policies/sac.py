"""SAC (stable-baselines3's) behind one class, for rewards that change while it learns."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
import torch
from gymnasium.spaces import Box
from stable_baselines3 import SAC
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.vec_env import VecEnv
from torch import nn

from polite.policies.episodes import EpisodeTally
from polite.policies.learned_reward import LearnedReward, RewardFunction
from polite.policies.policy import SquashedGaussianPolicy
from polite.policies.recorder import TrajectoryRecorder
from polite.policies.replay import IntrinsicReward, RelabelledReplay
from polite.policies.vec_env import GymnasiumVecEnv, check_spaces
from polite.types import InvalidValueError, Trajectory

REPORT_EVERY = 200
"""Env steps between two calls of `on_progress`."""


@dataclass(frozen=True)
class SacConfig:
    """Hyper-parameters of SAC, after B-Pref, with smaller nets and minibatches.

    B-Pref has 1024×2 and minibatches of 1024, which cost 27 times as much on two CPU threads (249
    ms an update against 9 ms). It also lets the temperature learn with 1e-4, updates the targets
    at every second step and bounds the logarithm of the actor's deviation by [−5, 2]; here the
    temperature has the common step size, targets follow at every update, and stable-baselines3's
    bounds [−20, 2] hold.
    """

    num_envs: int = 1
    """Envs that step together; as many updates follow each step of all of them."""
    hidden: tuple[int, ...] = (256, 256)
    """Units of each hidden layer of actor and critics."""
    batch_size: int = 256
    """Minibatch."""
    learning_rate: float = 5e-4
    """Adam's step size, for actor, critics and temperature."""
    discount: float = 0.99
    """gamma."""
    tau: float = 0.005
    """Share of the critics that their targets take over at each update."""
    temperature: float = 0.1
    """Initial weight of the entropy, which is learned."""
    random_steps: int = 1_000
    """Env steps with uniformly random actions at the start, in which nothing is learned."""
    replay_size: int = 1_000_000
    """Most transitions that are kept. A shorter run takes memory for its own steps only."""

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            InvalidValueError: naming the valid ranges, if a value is outside.
        """
        if (
            min(self.num_envs, self.batch_size, *self.hidden) < 1
            or self.replay_size < self.num_envs
            or self.random_steps < 0
            or min(self.learning_rate, self.temperature) <= 0
            or not (0 <= self.discount <= 1 and 0 < self.tau <= 1)
        ):
            raise InvalidValueError(
                "expected counts ≥ 1, replay_size ≥ num_envs, random_steps ≥ 0, learning_rate and "
                f"temperature > 0, discount in [0, 1], tau in (0, 1], got {self}"
            )


class SacTrainer:
    """Trains one policy stretch by stretch, each in an env of its own.

    All that one stretch hands on to the next is in `state`: with it, another process can go on and
    comes to the same numbers.
    """

    def __init__(
        self,
        env: GymnasiumVecEnv,
        config: SacConfig,
        seed: int,
        total_steps: int,
        reward: RewardFunction | None = None,
    ) -> None:
        """Set up.

        Args:
            env: Tells observations and actions; it is not stepped.
            config: Hyper-parameters.
            seed: Of weights, actions and minibatches. stable-baselines3 seeds PyTorch's and
                NumPy's global generators with it: run one training per process at a time.
            total_steps: Env steps of the whole training.
            reward: Replaces the true reward, if given.

        Raises:
            PoliteError: Observations or actions are of a kind that cannot be learned in
                (`check_spaces`).
        """
        check_spaces(env)
        self._config, self._reward = config, reward
        self._earlier: list[dict[str, float]] = []
        self._tally, self._before = EpisodeTally(env), 0
        rows = -(-total_steps // config.num_envs)
        self._model = SAC(
            "MlpPolicy",
            env,
            learning_rate=config.learning_rate,
            buffer_size=min(config.replay_size, rows * config.num_envs),
            learning_starts=config.random_steps,
            batch_size=config.batch_size,
            tau=config.tau,
            gamma=config.discount,
            gradient_steps=-1,  # as many as env steps
            ent_coef=f"auto_{config.temperature}",
            replay_buffer_class=RelabelledReplay,
            policy_kwargs={"net_arch": list(config.hidden), "optimizer_kwargs": {"fused": True}},
            seed=seed,
            device="cpu",
        )
        # Its own logger would leave an empty folder in the system's temporary folder each time.
        self._model.set_logger(Logger(None, []))

    @property
    def steps(self) -> int:
        """Env steps so far."""
        return self._model.num_timesteps

    @property
    def episodes(self) -> list[dict[str, float]]:
        """Finished episodes under the true reward (see `EpisodeTally`)."""
        present = [{**r, "step": r["step"] + self._before} for r in self._tally.records]
        return self._earlier + present

    @property
    def replay(self) -> RelabelledReplay:
        """The transitions."""
        replay = self._model.replay_buffer
        assert isinstance(replay, RelabelledReplay)
        return replay

    def train(
        self,
        env: GymnasiumVecEnv,
        until: int,
        on_progress: Callable[[int], object] | None = None,
        *,
        record: bool = True,
    ) -> list[Trajectory]:
        """Train in these envs, from their reset on, until so many env steps are done.

        Args:
            env: The envs of this stretch.
            until: Env steps, those of earlier stretches included.
            on_progress: Called every few hundred steps with the env steps done so far.
            record: Whether what happens is kept in memory.

        Returns:
            What happened, if it was recorded. Each env's last trajectory may be cut off.
        """
        self._earlier, self._before = self.episodes, self.steps
        self._tally = EpisodeTally(env)
        recorder = TrajectoryRecorder(self._tally, env)
        beneath: VecEnv = recorder if record else self._tally
        self._model.set_env(LearnedReward(beneath, self._reward) if self._reward else beneath)
        steps = until - self._before
        self._model.learn(steps, _Progress(on_progress), reset_num_timesteps=False)
        return recorder.trajectories()

    def pay(self, intrinsic: IntrinsicReward | None) -> None:
        """Pay by another reward from now on, or again by the stored one."""
        self.replay.intrinsic = intrinsic

    def relabel(self) -> None:
        """Write all stored rewards anew, by the reward model as it is now."""
        if self._reward is not None:
            self.replay.relabel(self._reward)

    def reset_critics(self, updates: int) -> None:
        """Begin with new critics, and train them and the actor on what is stored."""
        policy = self._model.policy
        fresh = policy.make_critic().state_dict()
        policy.critic.load_state_dict(fresh)
        policy.critic_target.load_state_dict(fresh)
        policy.critic.optimizer = torch.optim.Adam(
            policy.critic.parameters(), lr=self._config.learning_rate, fused=True
        )
        if updates > 0:
            self._model.train(updates, self._config.batch_size)

    def policy(self) -> SquashedGaussianPolicy:
        """A copy of the policy as it is now."""
        actor, space = self._model.actor, self._model.action_space
        layers = [layer for layer in actor.latent_pi if isinstance(layer, nn.Linear)]
        heads = (actor.mu, actor.log_std)
        both = [torch.cat([getattr(h, name) for h in heads]) for name in ("weight", "bias")]
        weights = [*(p for layer in layers for p in layer.parameters()), *both]
        assert isinstance(space, Box)
        return SquashedGaussianPolicy(
            weights=tuple(w.detach().numpy().copy() for w in weights),
            activation="relu",
            low=np.array(space.low, dtype=np.float32),
            high=np.array(space.high, dtype=np.float32),
        )

    def state(self) -> dict[str, Any]:
        """Everything that the next stretch depends on, as tensors that share memory and numbers.

        That is networks, targets, temperature, optimisers, replay, tallies and the global
        generators; not the reward model, nor an intrinsic reward.
        """
        model = self._model
        assert model.log_ent_coef is not None
        return {
            "networks": model.policy.state_dict(),
            "log_temperature": model.log_ent_coef.detach(),
            "optimisers": [optimiser.state_dict() for optimiser in self._optimisers()],
            "counts": (model.num_timesteps, model._n_updates, model._episode_num),
            "replay": self.replay.state(),
            "episodes": self.episodes,
            "generators": _global_generators(),
        }

    def load_state(self, state: dict[str, Any]) -> None:
        """Go on where another trainer of the same config and env was."""
        model = self._model
        assert model.log_ent_coef is not None
        model.policy.load_state_dict(state["networks"])
        with torch.no_grad():
            model.log_ent_coef.copy_(state["log_temperature"])
        for optimiser, content in zip(self._optimisers(), state["optimisers"], strict=True):
            optimiser.load_state_dict(content)
        model.num_timesteps, model._n_updates, model._episode_num = state["counts"]
        self.replay.load_state(state["replay"])
        self._earlier = list(state["episodes"])
        _set_global_generators(state["generators"])

    def _optimisers(self) -> list[torch.optim.Optimizer]:
        policy, temperature = self._model.policy, self._model.ent_coef_optimizer
        assert temperature is not None
        return [policy.actor.optimizer, policy.critic.optimizer, temperature]


class _Progress(BaseCallback):
    """Passes on the number of env steps every few hundred of them."""

    def __init__(self, on_progress: Callable[[int], object] | None) -> None:
        super().__init__()
        self._on_progress = on_progress
        self._told = 0

    def _on_step(self) -> bool:
        if self._on_progress is not None and self.num_timesteps >= self._told + REPORT_EVERY:
            self._on_progress(self.num_timesteps)
            self._told = self.num_timesteps
        return True

    def _on_training_end(self) -> None:
        if self._on_progress is not None:
            self._on_progress(self.num_timesteps)


def _global_generators() -> dict[str, Any]:
    """The states of the generators that stable-baselines3 draws from."""
    name, keys, *rest = cast(tuple[Any, ...], np.random.get_state(legacy=True))
    numbers = torch.from_numpy(keys.astype(np.int64))
    return {"torch": torch.get_rng_state(), "numpy": (str(name), numbers, *rest)}


def _set_global_generators(state: dict[str, Any]) -> None:
    torch.set_rng_state(state["torch"])
    name, numbers, *rest = state["numpy"]
    np.random.set_state((name, numbers.numpy().astype(np.uint32), *rest))
