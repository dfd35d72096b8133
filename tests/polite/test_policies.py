import tempfile
from itertools import pairwise

import gymnasium as gym
import mujoco
import numpy as np
import pytest
import torch
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from stable_baselines3.common.vec_env import VecNormalize
from stub_envs import CountingEnv, register, vec_env

from polite.policies.episodes import EpisodeTally
from polite.policies.learned_reward import LearnedReward
from polite.policies.policy import GaussianPolicy, load_policy, save_policy
from polite.policies.ppo import PpoConfig, PpoTrainer
from polite.policies.reward_wrapper import LearnedRewardWrapper
from polite.policies.vec_env import GymnasiumVecEnv, make_vec_env
from polite.rewards.files import load_reward_model, save_reward_model
from polite.rewards.network import RewardNet, RewardNetConfig, predict
from polite.types import InvalidValueError, NotFiniteError, PoliteError, ShapeError

SMALL = PpoConfig(num_envs=2, rollout=16, batch_size=16, epochs=2, hidden=(8, 8))
ZEROS = np.zeros((1, 2), np.float32)


def make_policy(activation="tanh", seed=0):
    rng = np.random.default_rng(seed)
    shapes = ((4, 3), (4,), (2, 4), (2,))
    return GaussianPolicy(
        weights=tuple(rng.normal(size=shape).astype(np.float32) for shape in shapes),
        activation=activation,
        log_std=np.array([-1.0, 0.5], np.float32),
        mean=rng.normal(size=3),
        variance=rng.uniform(0.5, 2.0, 3),
        low=np.array([-1.0, -0.5], np.float32),
        high=np.array([1.0, 0.5], np.float32),
    )


def test_a_policy_is_shown_by_its_layers() -> None:
    assert repr(make_policy()) == "GaussianPolicy(3-4-2, tanh)"


def test_a_file_of_the_other_kind_says_what_it_is(tmp_path, reward_file) -> None:
    path = tmp_path / "policy.pt"
    save_policy(path, make_policy())
    with pytest.raises(PoliteError, match=r"expected a reward model .*it is a policy's"):
        load_reward_model(path)
    with pytest.raises(PoliteError, match=r"expected a policy .*it is a reward model's"):
        load_policy(reward_file)
    path.write_bytes(path.read_bytes()[:300])
    with pytest.raises(PoliteError, match=r"\(it is cut short or damaged\)$"):
        load_policy(path)


@pytest.mark.parametrize("size", [1e39, -1e300])
def test_what_float32_cannot_hold_is_refused(reward_file, size) -> None:
    with pytest.raises(NotFiniteError, match="observations: expected numbers that float32"):
        predict(load_reward_model(reward_file), np.full((1, 2), size), ZEROS)
    env = vec_env()
    env.reset()
    env.vector_env.envs[0].steps = size
    env.step_async(ZEROS)
    with pytest.raises(NotFiniteError, match="env's observations and rewards: expected numbers"):
        env.step_wait()


# --- the adapter ---------------------------------------------------------------------------------


def test_an_ended_episode_leaves_its_last_observation_and_begins_anew() -> None:
    env = vec_env(lengths=(2, 3))
    assert env.reset().tolist() == [[0, 0]]
    assert env.step(ZEROS)[0].tolist() == [[1, 0]]
    observations, rewards, ended, infos = env.step(ZEROS)
    assert observations.tolist() == [[0, 1]]  # already the next episode
    assert rewards.tolist() == [1.0]
    assert ended.tolist() == [True]
    assert infos[0]["terminal_observation"].tolist() == [2, 0]
    assert infos[0]["TimeLimit.truncated"] is False


def test_a_time_limit_is_told_apart_from_an_end() -> None:
    env = vec_env(lengths=(9,), limit=2)
    env.reset()
    env.step(ZEROS)
    _, _, ended, infos = env.step(ZEROS)
    assert ended.tolist() == [True]
    assert infos[0]["TimeLimit.truncated"] is True


def test_envs_end_one_by_one() -> None:
    env = vec_env(count=3, lengths=(2,))
    env.reset()
    env.step(np.zeros((3, 2), np.float32))
    _, _, ended, infos = env.step(np.zeros((3, 2), np.float32))
    assert ended.all()
    assert all("terminal_observation" in info for info in infos)


def test_an_ended_episode_leaves_its_last_info() -> None:
    env = vec_env(count=2, lengths=(2,))
    env.reset()
    assert env.step(np.zeros((2, 2), np.float32))[3] == [{}, {}]
    infos = env.step(np.zeros((2, 2), np.float32))[3]
    assert [info["success"] for info in infos] == [1.0, 1.0]


def test_the_corridors_own_vector_env_is_used_and_nothing_copied(monkeypatch) -> None:
    env = make_vec_env("socialnav_env:SocialCorridor-v0", 3, 0, max_episode_steps=4)
    given, step = [], env.vector_env.step

    def noted(actions):
        given.append(step(actions))
        return given[-1]

    monkeypatch.setattr(env.vector_env, "step", noted)
    env.reset()
    for _ in range(4):
        observations, _, ended, infos = env.step(np.zeros((3, 2), np.float32))
    assert type(env.vector_env).__name__ == "SocialCorridorVectorEnv"
    assert observations is given[-1][0]
    assert ended.all()
    for n, info in enumerate(infos):
        assert info["terminal_observation"] is given[-1][4]["final_obs"][n]
        assert info["z_position"] == info["terminal_observation"][1]
        assert not any(name.startswith("_") for name in info)


@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.DISABLED])
def test_a_vector_env_that_resets_at_another_time_is_refused(mode) -> None:
    inner = SyncVectorEnv([lambda: gym.make("Pendulum-v1")], autoreset_mode=mode)
    with pytest.raises(PoliteError, match=r"expected autoreset_mode=AutoresetMode\.SAME_STEP"):
        GymnasiumVecEnv(inner, 0)


@pytest.mark.parametrize(
    "where",
    [{"spoiled_at": 2}, {"blind_at": 2}, {"blind_at": 2, "lengths": (2,)}],
    ids=["reward", "observation", "an episode's last observation"],
)
def test_nan_from_the_env_is_an_error_at_once(where) -> None:
    env = vec_env(**where)
    env.reset()
    env.step(ZEROS)
    with pytest.raises(NotFiniteError, match="check the env"):
        env.step(ZEROS)


@pytest.mark.parametrize("env_id", ["CartPole-v1", "NoSuchEnv-v0", "no id at all!"])
def test_an_env_that_cannot_be_used_is_a_one_line_error(env_id: str) -> None:
    with pytest.raises(PoliteError) as caught:
        make_vec_env(env_id, 1, 0)
    assert "\n" not in str(caught.value)


def test_an_env_without_continuous_actions_is_closed(monkeypatch) -> None:
    closed: list[SyncVectorEnv] = []
    monkeypatch.setattr(SyncVectorEnv, "close", lambda env: closed.append(env))
    with pytest.raises(PoliteError, match="continuous"):
        make_vec_env("CartPole-v1", 1, 0)
    assert len(closed) == 1


def test_an_unknown_setting_is_a_one_line_error() -> None:
    import socialnav_env  # noqa: F401

    with pytest.raises(PoliteError, match=r"SocialCorridor-v0.*gravity"):
        make_vec_env("SocialCorridor-v0", 1, 0, gravity=1.0)


# --- the learned reward --------------------------------------------------------------------------


def test_the_learned_reward_scores_the_observation_before_the_step() -> None:
    env = LearnedReward(vec_env(lengths=(3, 2)), lambda observations, actions: observations[:, 0])
    env.reset()
    scored = [env.step(ZEROS)[1].item() for _ in range(6)]
    assert scored == [0, 1, 2, 0, 1, 0]  # never the first observation of the next episode


def test_the_learned_reward_scores_the_action_that_the_env_was_given() -> None:
    env = LearnedReward(vec_env(), lambda observations, actions: actions[:, 1])
    env.reset()
    for value in (0.5, -0.25):
        assert env.step(np.array([[0.0, value]], np.float32))[1].tolist() == [value]


def test_the_true_reward_is_kept() -> None:
    env = LearnedReward(vec_env(), lambda observations, actions: -observations[:, 0])
    env.reset()
    action = np.array([[1.0, 0.0]], np.float32)
    infos = [env.step(action)[3][0] for _ in range(3)]
    assert [info["true_reward"] for info in infos] == pytest.approx([0.01, 1.01, 2.01])


def test_the_learned_reward_sees_raw_observations_beneath_vec_normalize() -> None:
    seen = []

    def reward(observations, actions):
        seen.append(observations.copy())
        return observations[:, 0]

    env = VecNormalize(LearnedReward(vec_env(lengths=(4,)), reward))
    env.reset()
    for _ in range(4):
        env.step(ZEROS)
    assert np.concatenate(seen)[:, 0].tolist() == [0, 1, 2, 3]


def test_the_tally_counts_whole_episodes_by_the_true_reward() -> None:
    env = EpisodeTally(vec_env(count=2, lengths=(3, 2)))
    env.reset()
    for _ in range(5):
        env.step(np.zeros((2, 2), np.float32))
    first = {"step": 6.0, "return": 3.0, "length": 3.0, "success": 1.0}
    second = {"step": 10.0, "return": 1.0, "length": 2.0, "success": 1.0}
    assert env.records == [first, first, second, second]


def test_the_tally_keeps_what_was_told_of_the_episode_and_nothing_else() -> None:
    register()
    env = EpisodeTally(make_vec_env("Talkative-v0", 2, 0, lengths=(2, 3)))
    env.reset()
    for _ in range(5):
        env.step(np.zeros((2, 2), np.float32))
    assert [record["success"] for record in env.records] == [0, 0, 1, 1]
    assert set(env.records[-1]) == {"step", "return", "length", "success"}


def test_the_time_limit_is_that_of_the_envs_that_were_made() -> None:
    register()
    for name, registered in (("Point-v0", 20), ("Endless-v0", None), ("SocialCorridor-v0", 600)):
        assert make_vec_env(name, 1, 0).time_limit == registered
        assert make_vec_env(name, 1, 0, max_episode_steps=7).time_limit == 7
        assert make_vec_env(name, 1, 0, max_episode_steps=-1).time_limit is None


# --- policies as numbers -------------------------------------------------------------------------


@pytest.mark.parametrize("activation", ["tanh", "relu"])
def test_the_mean_action_is_that_of_stable_baselines3(activation) -> None:
    register()
    config = PpoConfig(
        num_envs=2, rollout=16, batch_size=16, epochs=1, hidden=(8, 6), activation=activation
    )
    trainer = PpoTrainer(make_vec_env("Pendulum-v1", 2, 0), config, seed=0, total_steps=64)
    trainer.train(64)
    observations = np.random.default_rng(0).normal(scale=3.0, size=(50, 3))
    normalised = trainer._normalised.normalize_obs(observations)
    expected, _ = trainer._model.predict(normalised, deterministic=True)
    np.testing.assert_allclose(trainer.policy().mean_action(observations), expected, atol=1e-5)


def test_samples_scatter_around_the_mean_within_the_bounds() -> None:
    policy = make_policy()
    observations = np.tile(policy.mean, (20_000, 1))
    samples = policy.sample(observations, np.random.default_rng(1))
    assert (samples >= policy.low).all() and (samples <= policy.high).all()
    inside = np.abs(policy._mean(observations[:1])[0, 0]) < 0.1
    if inside:  # hardly clipped: the standard deviation is the policy's own
        assert samples[:, 0].std() == pytest.approx(np.exp(-1.0), rel=0.05)
    again = policy.sample(observations, np.random.default_rng(1))
    np.testing.assert_array_equal(samples, again)


def test_far_observations_are_clipped_as_in_training() -> None:
    policy = make_policy()
    far = np.tile(policy.mean, (2, 1)) + np.array([[11.0], [1e6]]) * np.sqrt(policy.variance)
    first, second = policy.mean_action(far)
    np.testing.assert_allclose(first, second, atol=1e-5)


def test_it_predicts_as_a_model_of_stable_baselines3_does() -> None:
    policy = make_policy()
    observations = np.random.default_rng(3).normal(size=(10, 3))
    actions, state = policy.predict(observations, "kept")
    np.testing.assert_array_equal(actions, policy.mean_action(observations))
    np.testing.assert_allclose(policy.predict(observations[4])[0], actions[4], atol=1e-6)
    assert state == "kept"
    with pytest.raises(PoliteError, match="sample"):
        policy.predict(observations, deterministic=False)


def test_wrong_observations_are_refused() -> None:
    with pytest.raises(ShapeError, match=r"\(N, 3\), got \(5, 4\)"):
        make_policy().mean_action(np.zeros((5, 4)))


def test_a_saved_policy_acts_alike(tmp_path) -> None:
    policy = make_policy("relu")
    save_policy(tmp_path / "policy.pt", policy)
    loaded = load_policy(tmp_path / "policy.pt")
    observations = np.random.default_rng(3).normal(size=(10, 3))
    np.testing.assert_array_equal(
        policy.mean_action(observations), loaded.mean_action(observations)
    )
    assert loaded.activation == "relu"
    np.testing.assert_array_equal(policy.log_std, loaded.log_std)


def test_a_missing_policy_is_an_error_that_names_the_file(tmp_path) -> None:
    with pytest.raises(PoliteError, match=r"policy\.pt: no such policy"):
        load_policy(tmp_path / "policy.pt")


@pytest.mark.parametrize(
    "damage", ["empty", "garbage", "cut short", "a list", "other keys", "code"]
)
def test_a_damaged_policy_is_a_one_line_error_that_names_the_file(tmp_path, damage: str) -> None:
    path = tmp_path / "policy.pt"
    save_policy(path, make_policy())
    contents = {"empty": b"", "garbage": b"garbage\n" * 99, "cut short": path.read_bytes()[:200]}
    objects = {"a list": [1], "other keys": {"weights": []}, "code": {"weights": print}}
    if damage in contents:
        path.write_bytes(contents[damage])
    else:
        torch.save(objects[damage], path)
    with pytest.raises(PoliteError, match=r"policy\.pt: expected a policy .*\(.+\)$") as caught:
        load_policy(path)
    assert "\n" not in str(caught.value)


def test_a_policy_with_nan_is_refused_when_it_is_read(tmp_path) -> None:
    policy = make_policy()
    policy.weights[0][0, 0] = np.nan
    save_policy(tmp_path / "policy.pt", policy)
    with pytest.raises(PoliteError, match=r"policy\.pt: .*NaN or infinity among its numbers"):
        load_policy(tmp_path / "policy.pt")


# --- PPO -----------------------------------------------------------------------------------------


def trained(seed, reward=None):
    trainer = PpoTrainer(make_vec_env("Pendulum-v1", 2, seed), SMALL, seed, 64, reward)
    trainer.train(64)
    return trainer.policy(), trainer.episodes


def test_equal_seeds_give_equal_policies() -> None:
    (first, episodes), (second, again), (other, _) = trained(0), trained(0), trained(1)
    for a, b in zip(first.weights, second.weights, strict=True):
        np.testing.assert_array_equal(a, b)
    np.testing.assert_array_equal(first.mean, second.mean)
    assert episodes == again
    assert any((a != b).any() for a, b in zip(first.weights, other.weights, strict=True))


def test_training_leaves_nothing_in_the_temporary_folder(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    trained(0)
    assert not list(tmp_path.iterdir())


def test_training_in_parts_goes_on_where_it_was() -> None:
    steps = []
    trainer = PpoTrainer(make_vec_env("Pendulum-v1", 2, 0), SMALL, 0, 128)
    trainer.train(32, steps.append)
    middle = trainer.policy()
    trainer.train(33, steps.append)  # rounded up to whole rollouts of 32
    assert steps == [32, 64, 96]
    later = trainer.policy()
    assert any((a != b).any() for a, b in zip(middle.weights, later.weights, strict=True))


def test_the_learning_rate_falls_over_the_whole_training() -> None:
    trainer = PpoTrainer(make_vec_env("Pendulum-v1", 2, 0), SMALL, 0, 128)
    rates = []
    for _ in range(4):
        trainer.train(32)
        rates.append(trainer._model.policy.optimizer.param_groups[0]["lr"])
    assert all(a > b for a, b in pairwise(rates))


def test_a_learned_reward_leaves_the_episodes_true() -> None:
    trainer = PpoTrainer(
        make_vec_env("Pendulum-v1", 2, 0), SMALL, 0, 416, lambda o, a: np.ones(len(o), np.float32)
    )
    trainer.train(416)  # Pendulum's episodes last 200 steps
    assert len(trainer.episodes) == 2
    assert all(episode["return"] < 0 for episode in trainer.episodes)


def test_spaces_are_those_of_the_env() -> None:
    env = make_vec_env("Pendulum-v1", 3, 0)
    assert env.num_envs == 3
    assert env.observation_space == gym.make("Pendulum-v1").observation_space


def test_a_model_that_mujoco_warns_about_is_made_without_a_word(
    tmp_path, monkeypatch, capfd
) -> None:
    monkeypatch.chdir(tmp_path)
    before = mujoco.get_mju_user_warning()
    make_vec_env("HalfCheetah-v5", 2, 0).close()
    assert capfd.readouterr() == ("", "")
    assert not list(tmp_path.iterdir())
    assert mujoco.get_mju_user_warning() is before  # what comes later is heard


# --- a learned reward for whatever trains a policy ------------------------------------------------


@pytest.fixture
def reward_file(tmp_path):
    net = RewardNet(2, 2, RewardNetConfig((4,), (0.0,)), torch.Generator().manual_seed(0))
    save_reward_model(tmp_path / "reward.pt", net)
    return tmp_path / "reward.pt"


def test_the_wrapper_pays_what_the_model_says_of_the_state_before(reward_file) -> None:
    env = LearnedRewardWrapper(CountingEnv(), reward_file)
    model = load_reward_model(reward_file)
    seen, _ = env.reset(seed=0)
    action = np.array([0.5, -0.5], np.float32)
    for _ in range(3):
        expected = predict(model, seen[None], action[None])[0]
        seen, reward, *_, info = env.step(action)
        assert reward == pytest.approx(float(expected), abs=1e-7)
        assert info["true_reward"] == pytest.approx(seen[0] - 1 + 0.005)


def test_the_wrapper_stands_even_where_the_env_writes_into_its_observation(reward_file) -> None:
    class Writing(CountingEnv):
        seen = np.zeros(2)

        def _observe(self):
            self.seen[:] = super()._observe()
            return self.seen

    rewards = []
    for made in (CountingEnv(), Writing()):
        env = LearnedRewardWrapper(made, reward_file)
        env.reset(seed=0)
        rewards.append([env.step(ZEROS[0])[1] for _ in range(3)])
    assert rewards[0] == rewards[1]


def test_an_offset_is_paid_on_top_for_every_step(reward_file) -> None:
    paid = []
    for offset in (0.0, 0.75):
        env = LearnedRewardWrapper(CountingEnv(), reward_file, reward_offset=offset)
        env.reset(seed=0)
        paid.append([env.step(ZEROS[0])[1] for _ in range(3)])
    np.testing.assert_allclose(np.subtract(*reversed(paid)), 0.75, atol=1e-6)


def test_the_wrapper_takes_a_model_and_leaves_it_as_it_is(reward_file) -> None:
    model = load_reward_model(reward_file)
    paid = []
    for reward in (reward_file, model):
        env = LearnedRewardWrapper(CountingEnv(), reward, reward_offset=0.5)
        env.reset(seed=0)
        paid.append(env.step(ZEROS[0])[1])
    assert paid[0] == paid[1]
    seen = np.array([[0.0, 0.0]])
    assert predict(model, seen, ZEROS) == predict(load_reward_model(reward_file), seen, ZEROS)


def test_the_wrapper_is_in_the_spec_of_its_env(reward_file) -> None:
    register()
    for reward in (reward_file, load_reward_model(reward_file)):
        paid = []
        env = LearnedRewardWrapper(gym.make("Counting-v0"), reward, reward_offset=0.5)
        for made in (env, gym.make(env.spec)):
            made.reset(seed=0)
            paid.append(made.step(ZEROS[0])[1])
        assert paid[0] == paid[1]


def test_what_is_no_reward_model_is_refused() -> None:
    with pytest.raises(InvalidValueError, match="reward_model: expected a reward model or its fi"):
        LearnedRewardWrapper(CountingEnv(), None)


def test_a_model_of_another_env_is_refused(reward_file) -> None:
    with pytest.raises(ShapeError, match=r"trained on .*\(\(2,\), \(2,\)\), got an env with"):
        LearnedRewardWrapper(gym.make("Pendulum-v1"), reward_file)
