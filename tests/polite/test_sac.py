import io
from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest
import torch
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from stub_envs import CountingEnv, PointEnv, register, vec_env

from polite.policies.policy import SquashedGaussianPolicy, load_policy, save_policy
from polite.policies.recorder import TrajectoryRecorder
from polite.policies.sac import SacConfig, SacTrainer
from polite.policies.vec_env import GymnasiumVecEnv, make_vec_env
from polite.rollouts import collect
from polite.types import InvalidValueError, PoliteError, ShapeError

register()
SMALL = SacConfig(hidden=(8, 8), batch_size=8, random_steps=10)


class LopsidedEnv(PointEnv):
    """A point that can go fast one way only, and tells where it is drawn."""

    action_space = gym.spaces.Box(np.float32([-3.0]), np.float32([0.5]))

    def state_vector(self):
        return np.array([10 * self.place, 7.0])


def lopsided(count=1, seed=0, limit=20):
    def make():
        return gym.wrappers.TimeLimit(LopsidedEnv(), limit)

    return GymnasiumVecEnv(
        SyncVectorEnv([make] * count, autoreset_mode=AutoresetMode.SAME_STEP), seed
    )


def score(observations, actions):
    """A reward that tells place and action apart."""
    return (observations[:, 0] + 10.0 * actions[:, 0]).astype(np.float32)


def trained(steps=30, env=lopsided, config=SMALL, reward=score, seed=0, total=200):
    trainer = SacTrainer(env(config.num_envs), config, seed, total, reward)
    happened = trainer.train(env(config.num_envs), steps)
    return trainer, happened


def bytes_of(policy):
    return b"".join(weight.tobytes() for weight in policy.weights)


# --- the policy ----------------------------------------------------------------------------------


def test_the_policy_taken_out_acts_as_the_one_inside() -> None:
    trainer, _ = trained()
    policy = trainer.policy()
    places = np.linspace(-3.0, 3.0, 30)[:, None]
    inside, _ = trainer._model.predict(places, deterministic=True)
    np.testing.assert_allclose(policy.mean_action(places), inside, atol=1e-5)
    np.testing.assert_array_equal(policy.predict(places[0])[0], policy.mean_action(places[:1])[0])


def test_draws_have_the_mean_and_the_spread_of_the_actor() -> None:
    trainer, _ = trained()
    place, draws = 0.7, 20_000
    actions = trainer.policy().sample(np.full((draws, 1), place), np.random.default_rng(0))
    assert actions.min() >= -3.0 and actions.max() <= 0.5
    gaussian = np.arctanh(2 * (actions.astype(float) + 3.0) / 3.5 - 1)
    with torch.no_grad():
        mean, log_std, _ = trainer._model.actor.get_action_dist_params(torch.tensor([[place]]))
    std = np.exp(log_std.item())
    assert gaussian.mean() == pytest.approx(mean.item(), abs=4 * std / draws**0.5)
    assert gaussian.std() == pytest.approx(std, rel=0.03)


def test_a_policy_that_is_read_back_is_the_same(tmp_path) -> None:
    policy = trained()[0].policy()
    save_policy(tmp_path / "policy.pt", policy)
    loaded = load_policy(tmp_path / "policy.pt")
    assert isinstance(loaded, SquashedGaussianPolicy)
    places = np.linspace(-3.0, 3.0, 30)[:, None]
    np.testing.assert_array_equal(loaded.mean_action(places), policy.mean_action(places))
    draws = [p.sample(places, np.random.default_rng(1)) for p in (loaded, policy)]
    np.testing.assert_array_equal(*draws)


def test_observations_of_another_size_are_refused() -> None:
    with pytest.raises(ShapeError, match=r"expects \(N, 1\), got \(3, 2\)"):
        trained()[0].policy().mean_action(np.zeros((3, 2)))


# --- the replay ----------------------------------------------------------------------------------


@pytest.mark.parametrize("num_envs", [1, 2])
def test_relabelling_reaches_the_whole_ring(num_envs) -> None:
    offsets = [0.0]
    config = replace(SMALL, num_envs=num_envs, replay_size=30 * num_envs)
    trainer, happened = trained(
        50 * num_envs, config=config, reward=lambda s, a: score(s, a) + np.float32(offsets[0])
    )
    replay = trainer.replay
    assert replay.full and replay.pos == 20  # written next: the middle of the ring
    given = [
        np.concatenate([score(t.observations, t.actions) for t in own])
        for own in np.array_split(np.array(happened, dtype=object), num_envs)
    ]
    expected = np.stack(given, axis=1)[20:50]  # the last 30 steps; of these, 20 … 29 are oldest
    expected = np.roll(expected, 20, axis=0)
    np.testing.assert_allclose(replay.rewards, expected, atol=1e-5)
    offsets[0] = 5.0
    trainer.relabel()
    np.testing.assert_allclose(replay.rewards, expected + 5.0, atol=1e-5)


def test_a_ring_that_is_not_full_is_relabelled_as_far_as_it_goes() -> None:
    trainer, _ = trained(12)
    trainer.replay.rewards[:] = -7.0
    trainer.relabel()
    assert not trainer.replay.full
    assert (trainer.replay.rewards[:12] != -7.0).all()
    assert (trainer.replay.rewards[12:] == -7.0).all()


def test_only_ends_are_ends_and_last_observations_are_kept() -> None:
    env = vec_env(limit=4, lengths=(3, 9))  # one episode ends, the next is cut off, and so on
    trainer = SacTrainer(env, SMALL, 0, 100)
    trainer.train(env, 7)
    replay = trainer.replay
    ends = replay.dones[:7, 0] * (1 - replay.timeouts[:7, 0])
    assert ends.tolist() == [0, 0, 1, 0, 0, 0, 0]
    assert replay.timeouts[:7, 0].tolist() == [0, 0, 0, 0, 0, 0, 1]
    assert replay.next_observations[:7, 0, 0].tolist() == [1, 2, 3, 1, 2, 3, 4]
    drawn = replay._get_samples(np.arange(7))
    assert drawn.dones[:, 0].tolist() == ends.tolist()


def test_an_intrinsic_reward_pays_what_is_drawn_and_is_not_stored() -> None:
    trainer, _ = trained(10, config=replace(SMALL, num_envs=2))
    seen = []

    def pay(states, among):
        seen.append((states, among))
        return states[:, 0] + 100.0

    rows, stored = np.arange(5), trainer.replay.rewards.copy()
    trainer.pay(pay)
    drawn = trainer.replay._get_samples(rows)
    torch.testing.assert_close(drawn.rewards, drawn.observations.float() + 100.0)
    ((states, among),) = seen
    assert torch.equal(states, drawn.observations.float())
    np.testing.assert_allclose(among[:, 0], trainer.replay.observations[:5].ravel(), rtol=1e-6)
    np.testing.assert_array_equal(trainer.replay.rewards, stored)
    trainer.pay(None)
    assert trainer.replay._get_samples(rows).rewards.max() < 50.0


# --- training ------------------------------------------------------------------------------------


def test_sac_learns_where_the_reward_is() -> None:
    config = SacConfig(hidden=(32, 32), batch_size=64, random_steps=100, learning_rate=3e-3)
    env = make_vec_env("Point-v0", 1, 0)
    trainer = SacTrainer(env, config, 0, 600)
    trainer.train(env, 600)
    actions = trainer.policy().mean_action(np.array([[-1.0], [0.0], [1.6], [2.0]]))[:, 0]
    assert actions[:2].min() > 0.5  # up to 1
    assert actions[2:].max() < -0.2  # and back down to it


@pytest.mark.parametrize("num_envs", [1, 2])
def test_random_steps_come_first_and_then_an_update_a_step(num_envs) -> None:
    config = replace(SMALL, num_envs=num_envs)
    env = lopsided(num_envs)
    trainer = SacTrainer(env, config, 0, 100)
    start = bytes_of(trainer.policy())
    trainer.train(lopsided(num_envs), 10)
    assert bytes_of(trainer.policy()) == start
    trainer.train(lopsided(num_envs), 30)
    assert bytes_of(trainer.policy()) != start
    assert trainer._model._n_updates == 20
    assert trainer.steps == 30


def test_critics_that_begin_anew() -> None:
    trainer, _ = trained()
    inside = trainer._model.policy
    before = {name: tensor.clone() for name, tensor in inside.state_dict().items()}
    trainer.reset_critics(0)
    for name, tensor in inside.state_dict().items():
        assert torch.equal(tensor, before[name]) == name.startswith("actor."), name
    for one, target in zip(
        inside.critic.parameters(), inside.critic_target.parameters(), strict=True
    ):
        assert torch.equal(one, target)
    assert not inside.critic.optimizer.state_dict()["state"]
    trainer.reset_critics(3)
    assert not torch.equal(inside.state_dict()["actor.mu.weight"], before["actor.mu.weight"])
    assert inside.critic.optimizer.state_dict()["state"][0]["step"] == 3


def test_the_true_return_is_noted_beneath_the_learned_reward() -> None:
    trainer = SacTrainer(vec_env(), SMALL, 0, 100, lambda s, a: np.zeros(len(s), np.float32))
    for until in (12, 24):  # two episodes of five steps in each stretch, and two more steps
        trainer.train(vec_env(), until)
    assert [episode["step"] for episode in trainer.episodes] == [5, 10, 17, 22]
    for episode in trainer.episodes:
        assert episode["return"] == pytest.approx(0 + 1 + 2 + 3 + 4, abs=0.05)
        assert episode["success"] == 1.0
    assert (trainer.replay.rewards == 0.0).all()


def test_another_trainer_goes_on_where_the_first_one_was() -> None:
    first, _ = trained(45)
    file = io.BytesIO()
    torch.save(first.state(), file)
    file.seek(0)
    first.train(lopsided(seed=5), 90)
    torch.manual_seed(99)
    np.random.seed(99)
    second = SacTrainer(lopsided(), SMALL, 0, 200, score)
    second.load_state(torch.load(file, weights_only=True))
    second.train(lopsided(seed=5), 90)
    assert bytes_of(first.policy()) == bytes_of(second.policy())
    assert first.episodes == second.episodes
    for name in ("observations", "actions", "rewards"):
        np.testing.assert_array_equal(getattr(first.replay, name), getattr(second.replay, name))
    a, b = (trainer._model.policy.state_dict() for trainer in (first, second))
    assert all(torch.equal(a[name], b[name]) for name in a)
    assert torch.equal(first._model.log_ent_coef, second._model.log_ent_coef)


def test_progress_is_told_to_the_last_step() -> None:
    told = []
    trainer = SacTrainer(lopsided(), replace(SMALL, random_steps=500), 0, 500)
    trainer.train(lopsided(), 450, told.append)
    assert told == [200, 400, 450]


def test_a_short_run_takes_memory_for_its_own_steps() -> None:
    assert trained(total=64)[0].replay.buffer_size == 64


def test_actions_without_bounds_are_refused() -> None:
    env = lopsided()
    env.action_space = gym.spaces.Box(-np.inf, np.inf, (1,))
    with pytest.raises(PoliteError, match="finite bounds"):
        SacTrainer(env, SMALL, 0, 100)


@pytest.mark.parametrize(
    "change",
    [
        {"num_envs": 0},
        {"hidden": (0,)},
        {"batch_size": 0},
        {"learning_rate": 0.0},
        {"discount": 1.1},
        {"tau": 0.0},
        {"temperature": 0.0},
        {"random_steps": -1},
        {"replay_size": 0},
    ],
)
def test_impossible_settings_are_refused(change) -> None:
    with pytest.raises(InvalidValueError, match="expected"):
        replace(SMALL, **change)


# --- the recorder --------------------------------------------------------------------------------


class Scripted:
    """The same actions at every call of the same number."""

    def __init__(self, count):
        self.rng, self.count = np.random.default_rng(0), count

    def __call__(self, observations):
        return self.rng.uniform(-3.0, 0.5, (self.count, 1)).astype(np.float32)


def test_what_is_recorded_is_what_a_rollout_collects() -> None:
    expected = collect(lopsided(2, limit=7).vector_env, Scripted(2), 17, seed=3)
    env, act = lopsided(2, seed=3, limit=7), Scripted(2)
    recorder = TrajectoryRecorder(env, env)
    assert recorder.trajectories() == []
    observations = recorder.reset()
    for _ in range(17):
        observations, *_ = recorder.step(act(observations))
    recorded = recorder.trajectories()
    assert [len(t) for t in recorded] == [len(t) for t in expected] == [7, 7, 3] * 2
    for one, other in zip(recorded, expected, strict=True):
        assert one.terminated == other.terminated
        for name in ("observations", "actions", "states"):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
        np.testing.assert_allclose(one.rewards, other.rewards, rtol=1e-6)
        np.testing.assert_allclose(one.states[:, 0], 10 * one.observations[:, 0], rtol=1e-6)


def test_what_a_policy_did_is_recorded_only_if_asked_for() -> None:
    trainer, happened = trained(45)
    assert [len(t) for t in happened] == [20, 20, 5]
    assert trainer.train(lopsided(), 60, record=False) == []


def test_an_env_that_cannot_tell_its_state_is_recorded_by_observations() -> None:
    assert not hasattr(CountingEnv, "state_vector")
    _, happened = trained(12, env=vec_env)
    assert [t.terminated for t in happened] == [True, True, False]
    for trajectory in happened:
        np.testing.assert_array_equal(trajectory.states, trajectory.observations)
