import json
from contextlib import contextmanager
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
import torch
from PIL import Image
from stub_envs import PointEnv

from polite.experiments import watch as watch_module
from polite.experiments.benchmark.grid import Run
from polite.experiments.benchmark.record import record_path
from polite.experiments.trained import read_trained
from polite.experiments.training.judge import judge
from polite.experiments.training.train import train
from polite.experiments.watch import paid, play, watch
from polite.files import write_json
from polite.plots.episode import below_frames
from polite.policies.policy import GaussianPolicy, save_policy
from polite.rewards.files import save_reward_model
from polite.rewards.network import FAST, RewardNet, predict
from polite.types import InvalidValueError, PoliteError
from polite.video import read_video

LIMIT = 30


class DrawnPointEnv(PointEnv):
    """A point that can be drawn: the further to the right, the brighter; 50 steps a second."""

    metadata = {"render_modes": ["rgb_array"]}  # noqa: RUF012 (Gymnasium's own form)
    dt = 0.02

    def __init__(self, render_mode=None) -> None:
        self.render_mode = render_mode

    def state_row(self):
        return np.array([self.place, 0.0])

    def render_state(self, row, trail):
        return np.full((48, 201, 3), 100 + 50 * row[0], np.uint8)


class PicturedPointEnv(PointEnv):
    """The same pictures of the present moment, but none of a recorded state."""

    metadata = {"render_modes": ["rgb_array"], "render_fps": 50}  # noqa: RUF012

    def __init__(self, render_mode=None) -> None:
        self.render_mode = render_mode

    def render(self):
        return DrawnPointEnv.render_state(self, [self.place], None)


class ErraticPointEnv(PicturedPointEnv):
    """Its seed does not say where it begins."""

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.place = np.random.default_rng().uniform(-1.0, 1.0)
        return np.array([self.place]), {}


class BlankPointEnv(PicturedPointEnv):
    """It says that it makes pictures, and makes what it is told to."""

    metadata = {"render_modes": ["rgb_array"], "render_fps": None}  # noqa: RUF012

    def __init__(self, render_mode=None, picture=None) -> None:
        super().__init__(render_mode)
        self.picture = picture

    def render(self):
        if self.picture == "missing":
            raise gym.error.DependencyNotInstalled("pencil is not installed")
        return {
            None: lambda: None,
            "float": lambda: np.ones((8, 8, 3)),
            "growing": lambda: np.zeros((8, 8 + round(10 * abs(self.place)), 3), np.uint8),
            "tiny": lambda: np.full((8, 8, 3), 100 + 50 * self.place, np.uint8),
        }[self.picture]()


class WalledPointEnv(DrawnPointEnv):
    """The same, but an episode ends at .5."""

    def step(self, action):
        observation, reward, _, _, info = super().step(action)
        return observation, reward, self.place > 0.5, False, info


if "DrawnPoint-v0" not in gym.registry:
    gym.register("DrawnPoint-v0", entry_point=DrawnPointEnv, max_episode_steps=LIMIT)
    gym.register("PicturedPoint-v0", entry_point=PicturedPointEnv, max_episode_steps=LIMIT)
    gym.register("ErraticPoint-v0", entry_point=ErraticPointEnv, max_episode_steps=LIMIT)
    gym.register("Silent-v0", entry_point=PointEnv, max_episode_steps=LIMIT)
    gym.register("BlankPoint-v0", entry_point=BlankPointEnv, max_episode_steps=LIMIT)
    gym.register("WalledPoint-v0", entry_point=WalledPointEnv, max_episode_steps=LIMIT)


def save_models(folder, observations=1):
    """A policy that goes to the right, .2 a step, and a reward model."""
    zeros = np.zeros((1, observations), np.float32)
    one = np.ones(1)
    policy = GaussianPolicy(
        weights=(zeros, np.array([1.0], np.float32)),
        activation="tanh",
        log_std=np.zeros(1, np.float32),
        mean=np.zeros(observations),
        variance=np.ones(observations),
        low=-one.astype(np.float32),
        high=one.astype(np.float32),
    )
    save_policy(folder / "policy.pt", policy)
    net = RewardNet(observations, 1, FAST, torch.Generator().manual_seed(0))
    save_reward_model(folder / "reward.pt", net)


def training(folder, env="DrawnPoint-v0", method="polite", **env_settings):
    save_models(folder / "models")
    config = {"env": env, "method": method, "queries": 20, "seed": 4}
    config["env_settings"] = env_settings
    write_json(folder / "results.json", {"config": config})
    return folder


@pytest.mark.parametrize(
    ("env", "steps"), [("DrawnPoint-v0", range(30, 31)), ("WalledPoint-v0", range(8))]
)
def test_the_episode_is_whole_and_the_first_of_those_that_judged_the_policy(
    tmp_path, env, steps
) -> None:
    trained = read_trained(training(tmp_path, env))
    episode = play(trained, 4)
    judged = judge(trained.make_env, trained.policy, 1, 4)
    assert episode.rewards.sum() == pytest.approx(judged["return"], rel=1e-12)
    assert len(episode) == judged["length"]
    assert len(episode) in steps


def test_what_is_paid_is_the_true_reward_and_the_model_s(tmp_path) -> None:
    trained = read_trained(training(tmp_path))
    episode = play(trained, 0)
    traces = paid(trained, episode)
    assert list(traces) == ["true reward", "r̂"]
    np.testing.assert_array_equal(traces["true reward"], episode.rewards)
    expected = predict(trained.reward, episode.observations, episode.actions)
    np.testing.assert_array_equal(traces["r̂"], expected)


def test_without_a_reward_model_the_true_reward_stands_alone(tmp_path) -> None:
    folder = training(tmp_path, method="ground-truth")
    (folder / "models" / "reward.pt").unlink()
    trained = read_trained(folder)
    assert trained.title == "DrawnPoint-v0, ground-truth, seed 4"
    assert list(paid(trained, play(trained, 0))) == ["true reward"]


@pytest.mark.parametrize("ending", ["gif", "mp4"])
@pytest.mark.parametrize("env", ["DrawnPoint-v0", "PicturedPoint-v0"])
def test_a_clip_shows_the_episode_in_real_time(tmp_path, env, ending) -> None:
    """50 steps a second: every second one is a frame. Whether from states or played once more."""
    folder = training(tmp_path / "run", env)
    out = watch(folder, tmp_path / f"clip.{ending}")
    frames, fps = read_video(out)
    assert (len(frames), fps) == (LIMIT / 2, 25)
    places = play(read_trained(folder), 0).observations[::2, 0]
    brightness = frames[:, :40, :200].mean((1, 2, 3))
    np.testing.assert_allclose(brightness, 100 + 50 * places, atol=3)


def test_without_a_path_the_clip_lies_beside_the_models(tmp_path) -> None:
    out = watch(training(tmp_path))
    assert out == tmp_path / "models" / "episode_0.webp"
    with Image.open(out) as clip:
        assert clip.n_frames == LIMIT / 2


def test_a_picture_has_some_of_the_frames(tmp_path) -> None:
    out = watch(training(tmp_path / "run"), tmp_path / "episode.png")
    with Image.open(out) as picture:
        assert picture.width > 1000
    assert watch(tmp_path / "run", tmp_path / "episode.pdf").read_bytes().startswith(b"%PDF")


def test_a_run_of_a_grid_is_watched_as_it_was_trained(tmp_path, monkeypatch) -> None:
    run = Run(
        env="Walker2d-v5",
        method="polite",
        queries=200,
        loss="pairwise",
        highlights="choice",
        preset="fast",
        steps=1000,
        variant="no-termination",
        seed=3,
    )
    folder = tmp_path / "models" / run.name
    save_models(folder)
    write_json(record_path(tmp_path, run), {"run": run.as_dict()})
    monkeypatch.chdir(folder)
    trained = read_trained(Path("."))  # wherever one stands
    assert trained.env == "Walker2d-v5"
    assert trained.title == "Walker2d-v5, polite-200, choice, no-termination, seed 3"
    env = trained.make_env(1, 0)
    assert env.vector_env.envs[0].unwrapped._terminate_when_unhealthy is False
    env.close()


def test_the_env_is_made_with_the_keywords_that_were_given(tmp_path) -> None:
    folder = training(tmp_path)
    results = json.loads((folder / "results.json").read_text("utf-8"))
    for limit in (7, 2 * LIMIT):
        results["config"]["env_settings"] = {"max_episode_steps": limit}
        write_json(folder / "results.json", results)
        assert len(play(read_trained(folder), seed=0)) == limit


def test_the_env_is_drawn_with_the_keywords_that_were_given(tmp_path, monkeypatch) -> None:
    drawn = []

    @contextmanager
    def seen(env_id, **settings):
        drawn.append(settings)
        with picture_env(env_id, **settings) as opened:
            yield opened

    picture_env = watch_module.picture_env
    monkeypatch.setattr(watch_module, "picture_env", seen)
    asked = ("half_width=4.0", "max_episode_steps=20")
    train(out=tmp_path / "run", queries=4, steps=1, evaluation_episodes=1, env_settings=asked)
    watch(tmp_path / "run", tmp_path / "episode.png")
    assert drawn[0]["half_width"] == 4.0


def test_nobody_was_asked_by_an_untrained_reward(tmp_path) -> None:
    title = read_trained(training(tmp_path, method="untrained")).title
    assert title == "DrawnPoint-v0, untrained, seed 4"


def test_a_training_in_the_corridor_can_be_watched(tmp_path) -> None:
    run = tmp_path / "run"
    train(out=run, queries=4, steps=1, evaluation_episodes=1)
    out = watch(run, tmp_path / "episode.png")
    with Image.open(out) as picture:
        assert len(set(picture.convert("L").getdata())) > 50
    assert read_trained(run).title == "SocialCorridor-v0, polite-4, seed 0"


def test_the_line_under_a_frame_is_where_its_step_is() -> None:
    """And the frames themselves stay as they are."""
    frames = np.random.default_rng(0).integers(0, 255, (3, 40, 300, 3)).astype(np.uint8)
    steps, values = [0, 50, 99], np.zeros(100)
    pictures = below_frames(frames, steps, {"true reward": values, "r̂": values}, 0.1, "title")
    np.testing.assert_array_equal(pictures[:, :40], frames)
    panels = pictures[:, 40:].astype(int)
    first, last = (np.flatnonzero((panels[k] != panels[1]).any((0, 2))) for k in (0, 2))
    left, middle, right = first.min(), first.max(), last.max()
    assert last.min() == middle - 1  # a line is two pixels wide
    assert (middle - left) / (right - left) == pytest.approx(50 / 99, abs=0.02)


@pytest.mark.parametrize("name", ["clip.avi", "clip", "clip.jpg"])
def test_another_ending_is_refused(tmp_path, name) -> None:
    with pytest.raises(PoliteError, match=r"expected an ending of \.webp"):
        watch(training(tmp_path / "run"), tmp_path / name)
    assert not (tmp_path / name).exists()


def with_unusual_pictures(test):
    """Gymnasium warns of them."""
    for says in ("not in the possible render_modes", "rendering should", "No render fps"):
        test = pytest.mark.filterwarnings(f"ignore:.*{says}")(test)
    return test


@with_unusual_pictures
@pytest.mark.parametrize(
    ("env", "picture", "says"),
    [
        ("ErraticPoint-v0", "", "the same seed and actions lead to the same episode, got another"),
        ("BlankPoint-v0", "", r"render\(\) gives a picture .* got NoneType"),
        ("BlankPoint-v0", "float", r"of uint8 .* got float64 \(8, 8, 3\)"),
        ("BlankPoint-v0", "missing", r"drawn here \(DependencyNotInstalled: pencil is not"),
        ("BlankPoint-v0", "growing", "expected pictures of one size"),
        ("Silent-v0", "", "cannot make 'Silent-v0' to draw: .*render_mode"),
    ],
)
def test_an_env_that_cannot_be_drawn_is_refused(tmp_path, env, picture, says) -> None:
    folder = training(tmp_path, env, **({"picture": picture} if picture else {}))
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(PoliteError, match=says):
        watch(folder)
    assert sorted(tmp_path.rglob("*")) == before


@with_unusual_pictures
def test_small_pictures_are_enlarged_and_a_pace_that_is_not_told_is_the_usual(tmp_path) -> None:
    folder = training(tmp_path / "run", "BlankPoint-v0", picture="tiny")
    frames, fps = read_video(watch(folder, tmp_path / "clip.mp4"))
    assert (len(frames), round(fps)) == (LIMIT / 2, 15)
    assert frames.shape[2] == 200
    places = play(read_trained(folder), 0).observations[::2, 0]
    np.testing.assert_allclose(frames[:, :200].mean((1, 2, 3)), 100 + 50 * places, atol=3)


def test_an_env_of_gymnasium_s_own_is_watched(tmp_path) -> None:
    run = tmp_path / "run"
    train(out=run, env="Pendulum-v1", queries=4, steps=1, evaluation_episodes=1)
    with Image.open(watch(run)) as clip:
        assert clip.n_frames == 100  # of 200 steps, 30 a second


def test_a_seed_below_0_is_refused(tmp_path) -> None:
    with pytest.raises(InvalidValueError, match="seed: expected a whole number of at least 0"):
        watch(training(tmp_path), seed=-1)


def test_a_folder_without_a_policy_is_refused(tmp_path) -> None:
    with pytest.raises(PoliteError, match=r"no trained policy; give the folder of a finished"):
        watch(tmp_path)


def test_the_folder_of_the_models_alone_says_which_one_to_give(tmp_path) -> None:
    folder = training(tmp_path)
    with pytest.raises(PoliteError, match=f"give {folder}$"):
        watch(folder / "models")


@pytest.mark.parametrize("content", [None, "{", "[]", "{}", '{"config": 3}', '{"config": {}}'])
def test_a_damaged_training_is_a_one_line_error(tmp_path, content) -> None:
    folder = training(tmp_path)
    path = folder / "results.json"
    path.unlink() if content is None else path.write_text(content, encoding="utf-8")
    with pytest.raises(PoliteError, match=r"results\.json") as caught:
        watch(folder)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("change", [{"env": 7}, {"budget": 3}, {"preset": "none"}])
def test_a_damaged_record_is_a_one_line_error(tmp_path, change) -> None:
    folder = tmp_path / "models" / "some"
    save_models(folder)
    record = json.loads("""{"env": "Walker2d-v5", "method": "ground-truth", "queries": 0,
        "loss": null, "highlights": null, "preset": "fast", "steps": 9}""")
    write_json(tmp_path / "runs" / "some.json", {"run": record | change})
    with pytest.raises(PoliteError) as caught:
        watch(folder)
    assert "\n" not in str(caught.value)
