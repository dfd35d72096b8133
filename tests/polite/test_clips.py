import imageio.v3 as iio
import numpy as np
import pytest
from PIL import Image

from polite.clips import frames_of, write_clip
from polite.types import ShapeError


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
