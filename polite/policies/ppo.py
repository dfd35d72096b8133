"""PPO (stable-baselines3's) behind one class."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.vec_env import VecEnv, VecNormalize

from polite.policies.episodes import EpisodeTally
from polite.policies.learned_reward import LearnedReward, RewardFunction
from polite.policies.policy import GaussianPolicy
from polite.policies.vec_env import GymnasiumVecEnv, check_spaces


@dataclass(frozen=True)
class PpoConfig:
    """Hyper-parameters of PPO."""

    num_envs: int = 32
    """Envs that step together."""
    rollout: int = 64
    """Steps of each env between two updates."""
    batch_size: int = 256
    """Minibatch."""
    epochs: int = 10
    """Passes over a rollout."""
    learning_rate: float = 1e-3
    """Adam's step size at the start."""
    anneal: bool = True
    """Whether it falls linearly to 0 over the training, or stays."""
    discount: float = 0.99
    """gamma."""
    gae_lambda: float = 0.95
    """lambda of generalised advantage estimation."""
    clip: float = 0.2
    """Clip range of the probability ratio."""
    entropy: float = 0.0
    """Weight of the entropy bonus."""
    value_coefficient: float = 0.5
    """Weight of the value loss."""
    max_grad_norm: float = 0.5
    """Gradients are scaled down to this norm."""
    hidden: tuple[int, ...] = (64, 64)
    """Units of each hidden layer of policy and value network."""
    activation: Literal["tanh", "relu"] = "tanh"
    """Activation of the hidden layers."""
    log_std: float = -0.5
    """Logarithm of the initial standard deviation of actions."""
    orthogonal: bool = True
    """Whether the initial weights are orthogonal, or PyTorch's."""


class PpoTrainer:
    """Trains one policy; training can be taken up again after the reward has changed.

    Attributes:
        episodes: Tallies of all finished episodes, under the true reward.
    """

    def __init__(
        self,
        env: GymnasiumVecEnv,
        config: PpoConfig,
        seed: int,
        total_steps: int,
        reward: RewardFunction | None = None,
    ) -> None:
        """Set up.

        Args:
            env: The envs.
            config: Hyper-parameters.
            seed: Of weights, actions and minibatches. stable-baselines3 seeds PyTorch's and
                NumPy's global generators with it: run one training per process at a time.
            total_steps: Env steps until the learning rate has fallen to 0.
            reward: Replaces the true reward, if given.

        Raises:
            PoliteError: Observations or actions are of a kind that cannot be learned in
                (`check_spaces`).
        """
        check_spaces(env)
        self._tally = EpisodeTally(env)
        beneath: VecEnv = LearnedReward(self._tally, reward) if reward else self._tally
        self._normalised = VecNormalize(beneath, gamma=config.discount)
        self._config = config
        self._total_steps = total_steps
        self._model = PPO(
            "MlpPolicy",
            self._normalised,
            n_steps=config.rollout,
            batch_size=config.batch_size,
            n_epochs=config.epochs,
            learning_rate=self._learning_rate,
            gamma=config.discount,
            gae_lambda=config.gae_lambda,
            clip_range=config.clip,
            ent_coef=config.entropy,
            vf_coef=config.value_coefficient,
            max_grad_norm=config.max_grad_norm,
            policy_kwargs={
                "net_arch": list(config.hidden),
                "activation_fn": torch.nn.Tanh if config.activation == "tanh" else torch.nn.ReLU,
                "log_std_init": config.log_std,
                "ortho_init": config.orthogonal,
                # stable-baselines3's own epsilon; the fused step saves a twentieth of a training
                "optimizer_kwargs": {"eps": 1e-5, "fused": True},
            },
            seed=seed,
            device="cpu",
        )
        # Its own logger would leave an empty folder in the system's temporary folder each time.
        self._model.set_logger(Logger(None, []))

    @property
    def episodes(self) -> list[dict[str, float]]:
        """Finished episodes under the true reward (see `EpisodeTally`)."""
        return self._tally.records

    def train(self, steps: int, on_progress: Callable[[int], object] | None = None) -> None:
        """Train for at least `steps` env steps more, in whole rollouts.

        Args:
            steps: Env steps.
            on_progress: Called after each rollout with the env steps done so far.
        """
        self._model.learn(steps, callback=_Progress(on_progress), reset_num_timesteps=False)

    def policy(self) -> GaussianPolicy:
        """A copy of the policy as it is now."""
        space: Any = self._normalised.action_space
        network = self._model.policy
        layers = [m for m in network.mlp_extractor.policy_net if isinstance(m, torch.nn.Linear)]
        weights = [p for layer in [*layers, network.action_net] for p in layer.parameters()]
        statistics: Any = self._normalised.obs_rms
        return GaussianPolicy(
            weights=tuple(w.detach().numpy().copy() for w in weights),
            activation=self._config.activation,
            log_std=network.log_std.detach().numpy().copy(),
            mean=np.array(statistics.mean, dtype=np.float64),
            variance=np.array(statistics.var, dtype=np.float64),
            low=np.array(space.low, dtype=np.float32),
            high=np.array(space.high, dtype=np.float32),
        )

    def _learning_rate(self, _: float) -> float:
        """Linear decay over the whole training, however many times `train` is called."""
        if not self._config.anneal:
            return self._config.learning_rate
        done = self._model.num_timesteps if hasattr(self, "_model") else 0
        return self._config.learning_rate * max(0.0, 1.0 - done / self._total_steps)


class _Progress(BaseCallback):
    """Passes on the number of env steps after each rollout."""

    def __init__(self, on_progress: Callable[[int], object] | None) -> None:
        super().__init__()
        self._on_progress = on_progress

    def _on_step(self) -> bool:
        return True

    def _on_rollout_end(self) -> None:
        if self._on_progress is not None:
            self._on_progress(self.num_timesteps)
