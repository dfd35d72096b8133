import os

import imageio.v3 as iio
import numpy as np
import pytest
from PIL import Image

import socialnav_env  # noqa: F401 (registers the corridor)
from polite.clips import frames_of, renderer, write_clip
from polite.dataset import Feedback
from polite.experiments.clips import draw_query
from polite.policies.vec_env import make_vec_env
from polite.rollouts import collect, state_rows
from polite.segments import cut_segments
from polite.types import PoliteError, Query, ShapeError

SMALL = {"width": 64, "height": 48}
NO_TRAIL = np.zeros((0, 2))


def moving_square(count=6):
    """(count, 24, 32, 3) frames in which a white square moves to the right."""
    frames = np.zeros((count, 24, 32, 3), np.uint8)
    for t in range(count):
        frames[t, 8:16, 4 * t : 4 * t + 8] = 255
    return frames


def test_each_state_is_drawn_with_the_way_so_far() -> None:
    states = np.arange(12.0).reshape(4, 3)
    seen = []

    def render(row, trail):
        seen.append((row.copy(), trail.copy()))
        return np.full((2, 2, 3), len(trail), np.uint8)

    frames = frames_of(states, render)
    assert frames[:, 0, 0, 0].tolist() == [1, 2, 3, 4]
    for t, (row, trail) in enumerate(seen):
        np.testing.assert_array_equal(row, states[t])
        np.testing.assert_array_equal(trail, states[: t + 1, :2])


@pytest.mark.parametrize("ending", ["gif", "webp"])
def test_a_clip_can_be_read_back(tmp_path, ending: str) -> None:
    path = tmp_path / "deep" / f"clip.{ending}"
    frames = moving_square()
    write_clip(path, frames, fps=10)
    read = np.asarray(list(iio.imiter(path)))[..., :3]
    assert read.shape == frames.shape
    difference = np.abs(read.astype(int) - frames)
    assert difference.mean() < 3  # a lossy format blurs an edge
    with Image.open(path) as clip:
        clip.seek(1)
        clip.load()
        assert clip.info["duration"] == 100  # milliseconds: 10 frames a second
        assert clip.info["loop"] == 0  # for ever
    assert [p.name for p in path.parent.iterdir()] == [path.name]


@pytest.mark.parametrize("shape", [(0, 4, 4, 3), (4, 4, 3), (2, 4, 4, 1)])
def test_what_is_no_clip_is_refused(tmp_path, shape: tuple[int, ...]) -> None:
    with pytest.raises(ShapeError, match="expected"):
        write_clip(tmp_path / "clip.gif", np.zeros(shape, np.uint8), 10)
    assert not list(tmp_path.iterdir())


def test_a_clip_of_the_corridor_shows_the_robot_moving() -> None:
    from socialnav_env import SocialCorridorEnv

    env = SocialCorridorEnv(render_width=320)
    env.reset(seed=0)
    rows = []
    for _ in range(8):
        rows.append(env.state_row())
        env.step(np.array([1.0, 0.0]))
    frames = frames_of(np.array(rows), env.render_state)
    assert frames.shape[0] == 8 and frames.dtype == np.uint8
    assert (frames[0] != frames[-1]).any()


# --- an env for pictures -------------------------------------------------------------------------


def lively(env_id, count=1, seed=0):
    """A vector env and a source of actions that move it about."""
    vector_env = make_vec_env(env_id, count, seed).vector_env
    rng = np.random.default_rng(seed)
    shape = vector_env.action_space.shape
    return vector_env, lambda _: rng.uniform(-1.0, 1.0, shape).astype(np.float32)


@pytest.mark.parametrize("env_id", ["Walker2d-v5", "HalfCheetah-v5"])
def test_a_mujoco_state_gives_the_picture_of_its_moment(make_mujoco, env_id: str) -> None:
    import mujoco

    env = make_mujoco(env_id, render_mode="rgb_array", camera_name="track", **SMALL)
    env.reset(seed=3)
    env.action_space.seed(0)
    rows, pictures = [], []
    for _ in range(6):
        rows.append(env.unwrapped.state_vector())
        pictures.append(env.render())
        for _ in range(5):
            env.step(env.action_space.sample())
        # After a step MuJoCo still has the bodies where the step's last part began.
        mujoco.mj_forward(env.unwrapped.model, env.unwrapped.data)
    with renderer(env_id, **SMALL) as (render, _):
        order = [4, 0, 5, 2, 1, 3, 4]  # no picture depends on the one before
        for t in order:
            np.testing.assert_array_equal(render(rows[t], NO_TRAIL), pictures[t])
    assert len({picture.tobytes() for picture in pictures}) == 6


def test_the_camera_follows_the_robot(make_mujoco) -> None:
    """However far it ran, the robot fills the same part of the picture."""
    with renderer("HalfCheetah-v5", **SMALL) as (render, _):
        here, there = np.zeros(18), np.zeros(18)
        there[0] = 8.0  # two of the floor's squares, so that the floor looks the same
        near, far = (render(row, NO_TRAIL).astype(int) for row in (here, there))
    assert np.abs(near - far).mean() < 2  # the light stands elsewhere
    assert near.std() > 20


@pytest.mark.parametrize("env_id", ["Hopper-v5", "SocialCorridor-v0"])
def test_drawing_does_not_disturb_a_running_env(make_mujoco, env_id: str) -> None:
    size = SMALL if env_id == "Hopper-v5" else {"render_width": 320}
    rows = {}
    for draws in (False, True):
        env, act = lively(env_id, count=2)
        env.reset(seed=0)
        rows[draws] = []
        with renderer(env_id, **size) as (render, _):
            for _ in range(8):
                rows[draws].append(state_rows(env))
                if draws:
                    render(rows[draws][0][1], rows[draws][0][1:, :2])
                env.step(act(None))
        env.close()
    np.testing.assert_array_equal(rows[True], rows[False])
    assert not np.array_equal(rows[True][0], rows[True][-1])


def test_a_row_of_another_env_is_refused(make_mujoco) -> None:
    with (
        renderer("Hopper-v5", **SMALL) as (render, _),
        pytest.raises(ShapeError, match=r"row: expected \(12,\), got \(18,\)"),
    ):
        render(np.zeros(18), NO_TRAIL)


@pytest.mark.parametrize(
    ("env_id", "says"),
    [("Nowhere-v0", "Nowhere"), ("nowhere:Point-v0", "nowhere")],
)
def test_an_env_that_cannot_be_made_is_a_one_line_error(env_id: str, says: str) -> None:
    with pytest.raises(PoliteError, match=f"cannot make .*{says}") as error, renderer(env_id):
        pass
    assert "\n" not in str(error.value)


def test_an_env_that_cannot_go_back_to_a_state_is_refused() -> None:
    expected = pytest.raises(PoliteError, match=r"Pendulum-v1: expected an env with render_state")
    with expected, renderer("Pendulum-v1"):
        pass


def test_without_a_way_to_draw_the_error_says_what_to_install(make_mujoco, monkeypatch) -> None:
    def without_egl(*args):
        raise ImportError("no EGL")

    viewer = "gymnasium.envs.mujoco.mujoco_rendering.OffScreenViewer"
    monkeypatch.setattr(viewer, without_egl)
    expected = pytest.raises(PoliteError, match=r"MuJoCo cannot draw here \(no EGL\).* libegl1")
    with expected, renderer("Hopper-v5", **SMALL):
        pass


def test_how_mujoco_draws_is_chosen_for_the_moment_only(make_mujoco, monkeypatch) -> None:
    monkeypatch.delenv("MUJOCO_GL")
    monkeypatch.delenv("DISPLAY", raising=False)
    with renderer("Hopper-v5", **SMALL) as (render, steps_per_second):
        assert render(np.r_[0.0, 1.25, np.zeros(10)], NO_TRAIL).shape == (48, 64, 3)
        assert "MUJOCO_GL" not in os.environ
    assert steps_per_second == pytest.approx(125.0)


@pytest.mark.parametrize(
    ("env_id", "size", "pause"),
    [("Hopper-v5", SMALL, 20), ("SocialCorridor-v0", {"render_width": 320}, 100)],
)
def test_a_query_becomes_two_clips(make_mujoco, tmp_path, env_id, size, pause: int) -> None:
    env, act = lively(env_id)
    rng = np.random.default_rng(0)
    pool = cut_segments(collect(env, act, 30, seed=0), 9, 3, rng)
    env.close()
    feedback = Feedback(pool, [Query(0, 1), Query(2, 0)], [])
    paths = draw_query(tmp_path / "clips", feedback, 1, env_id, **size)
    assert [path.name for path in paths] == ["query_1_first.gif", "query_1_second.gif"]
    with renderer(env_id, **size) as (render, _):
        for path, index in zip(paths, (2, 0), strict=True):
            drawn = frames_of(pool[index].states, render)
            with Image.open(path) as clip:
                assert clip.info["duration"] == pause  # milliseconds
            read = np.asarray(list(iio.imiter(path)))[..., :3]
            assert read.shape == drawn.shape
            assert np.abs(read.astype(int) - drawn).mean() < 6  # a GIF has 256 colours
