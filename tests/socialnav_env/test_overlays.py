import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from socialnav_env.config import ConfigError, CorridorConfig
from socialnav_env.rendering import (
    CAMERAS,
    DEFAULT_OVERLAYS,
    OVERLAYS,
    Annotations,
    Scene,
    SceneError,
    draw_scene,
    tile,
)
from socialnav_env.rendering.camera import centred, view_of
from socialnav_env.rendering.overlays import (
    ARROW_HEAD,
    METRES_PER_FORCE,
    arrow,
    bar_share,
    check_look,
    ray_ends,
)

CONFIG = CorridorConfig()
GOALS = np.array([[0.3, -2.5], [-0.5, 12.0]])
PEOPLE = np.array([[1.5, -6.0, 0.2, 0.2, 0.9], [-1.2, 5.0, -2.4, 0.0, 0.0]])
TRAIL = np.array([[0.0, -14.0], [0.4, -3.0]])
NOTES = Annotations(
    rays=np.linspace(1.0, 6.0, 9),
    forces=np.array([[1.0, -2.0], [0.0, 0.0]]),
    terms={"reward_goal": 0.0, "reward_progress": 0.016, "reward_collision": -1.0},
)


def scene(robot=(0.4, -3.0, 0.7), people=PEOPLE, trail=TRAIL):
    return Scene(robot, people, GOALS, False, False, trail)


def changed(one, other):
    """Rows and columns of the pixels that differ."""
    return np.nonzero((one != other).any(axis=2))


# --- which overlays ------------------------------------------------------------------------------


def test_the_defaults_are_what_one_gets_for_nothing():
    asked = draw_scene(scene(), CONFIG, 480, camera="corridor", overlays=DEFAULT_OVERLAYS)
    assert np.array_equal(draw_scene(scene(), CONFIG, 480), asked)


@pytest.mark.parametrize("camera", CAMERAS)
@pytest.mark.parametrize("overlay", OVERLAYS)
def test_each_overlay_adds_to_the_picture(overlay, camera):
    bare = draw_scene(scene(), CONFIG, 480, camera=camera, overlays=(), annotations=NOTES)
    shown = draw_scene(scene(), CONFIG, 480, camera=camera, overlays=[overlay], annotations=NOTES)
    assert bare.shape != shown.shape or not np.array_equal(bare, shown)


@pytest.mark.parametrize("overlay", ["rays", "forces", "reward"])
def test_an_overlay_without_numbers_stays_empty_and_the_picture_keeps_its_size(overlay):
    empty = draw_scene(scene(), CONFIG, 480, overlays=[overlay])
    shown = draw_scene(scene(), CONFIG, 480, overlays=[overlay], annotations=NOTES)
    assert empty.shape == shown.shape
    assert not np.array_equal(empty, shown)
    bare = draw_scene(scene(), CONFIG, 480, overlays=())
    assert np.array_equal(empty[: len(bare) - 16], bare[:-16])


def test_the_order_of_overlays_does_not_matter():
    one, other = (
        draw_scene(scene(), CONFIG, 480, overlays=names, annotations=NOTES)
        for names in (OVERLAYS, OVERLAYS[::-1])
    )
    assert np.array_equal(one, other)


@pytest.mark.parametrize("overlays", [("rays", "smell"), "rays", (7,)])
def test_an_unknown_overlay_is_an_error_that_lists_the_valid_ones(overlays):
    with pytest.raises(ConfigError, match=r"overlays=.*expected some of rays, personal_space, for"):
        draw_scene(scene(), CONFIG, overlays=overlays)


def test_an_unknown_camera_is_an_error_that_lists_the_valid_ones():
    with pytest.raises(ConfigError, match="camera='drone': expected one of corridor, robot"):
        check_look("drone", DEFAULT_OVERLAYS)


# --- what they show ------------------------------------------------------------------------------


def test_rays_end_where_their_ranges_say():
    # It looks to the left, so the rays go from +z over +x to -z.
    ends = ray_ends(np.array([1.0, -3.0, math.pi / 2]), np.full(9, 2.0))
    np.testing.assert_allclose(ends[[0, 4, 8]], [[1, -1], [3, -3], [1, -5]], atol=1e-12)
    np.testing.assert_allclose(np.hypot(*(ends - [1.0, -3.0]).T), 2.0)


def test_a_ray_that_meets_nothing_has_no_dot():
    notes = Annotations(rays=np.full(9, 2.0))
    dots, no_dots = (
        draw_scene(scene(), CorridorConfig(ray_range=reach), overlays=["rays"], annotations=notes)
        for reach in (6.0, 2.0)
    )
    rows, columns = changed(dots, no_dots)
    view = view_of(CONFIG, 960)
    away = np.stack([columns + 0.5, rows + 0.5]) - np.array([view.place(0.4, -3.0)]).T
    assert abs(np.hypot(*away) - 2.0 * view.scale).max() < 4.0


@given(
    size=st.floats(0.01, 100.0),
    angle=st.floats(-math.pi, math.pi),
)
def test_an_arrow_points_along_its_force_and_is_no_longer_than_allowed(size, angle):
    force = size * np.array([math.sin(angle), math.cos(angle)])
    outline = arrow(force, 0.3)
    tip = outline[3]
    np.testing.assert_allclose(np.cross([*tip, 0.0], [*force, 0.0])[2], 0.0, atol=1e-9 * size)
    assert tip @ force > 0
    assert np.hypot(*tip) == pytest.approx(0.3 + min(METRES_PER_FORCE * size, 2.5))


def test_a_force_is_drawn_beside_its_person():
    notes = Annotations(forces=np.array([[0.0, 2.0], [0.0, 0.0]]))
    bare, shown = (
        draw_scene(scene(), CONFIG, 960, overlays=["forces"], annotations=a) for a in (None, notes)
    )
    view = view_of(CONFIG, 960)
    rows, columns = changed(bare, shown)
    column, row = view.place(*PEOPLE[0, :2])
    reach = (CONFIG.human_radius + 2.0 * METRES_PER_FORCE) * view.scale
    assert abs(columns.max() + 1 - (column + reach)) <= 2
    assert columns.min() >= column
    assert abs(rows - row).max() < 0.5 * ARROW_HEAD * view.scale + 2


def test_bars_are_signed_grow_with_the_term_and_stop_at_one():
    assert bar_share(0.0) == 0.0
    assert bar_share(1.0) == pytest.approx(1.0)
    assert bar_share(-1.0) == pytest.approx(-1.0)
    assert bar_share(50.0) == 1.0
    assert bar_share(0.001) == pytest.approx(math.log(2) / math.log(1001))
    shares = [bar_share(term) for term in np.linspace(-1.5, 1.5, 301)]
    assert (np.diff(shares) >= 0).all()


def test_gains_and_losses_lie_on_different_sides_and_in_different_colours():
    def bar(term):
        notes = Annotations(terms={"reward_goal": term})
        pictures = [
            draw_scene(scene(), CONFIG, 480, overlays=["reward"], annotations=a)
            for a in (Annotations(terms={"reward_goal": 0.0}), notes)
        ]
        view = view_of(CONFIG, 480, rewards=True)
        row = round(view.strip + 1.9 * view.font)
        columns = np.nonzero((pictures[0][row] != pictures[1][row]).any(axis=1))[0]
        return columns - 240, pictures[1][row, columns[0]].astype(int)

    (gain, green), (loss, red) = bar(0.5), bar(-0.5)
    assert gain.min() >= 0 > loss.max()
    assert green[1] > green[0] and red[0] > red[2]
    assert abs(len(gain) - len(loss)) <= 2


# --- bad annotations -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "value"),
    [("rays", np.zeros(8)), ("rays", np.full(9, math.nan)), ("forces", np.zeros(2))],
)
def test_bad_annotations_are_named(name, value):
    with pytest.raises(SceneError, match=f"{name}: expected"):
        Annotations(**{name: value})


def test_a_reward_term_that_is_not_finite_is_named():
    with pytest.raises(SceneError, match="terms: expected finite numbers, got reward_goal=inf"):
        Annotations(terms={"reward_goal": math.inf})


def test_forces_must_be_one_a_person():
    with pytest.raises(SceneError, match="forces: expected 2, one a person, got 3"):
        draw_scene(
            scene(), CONFIG, overlays=["forces"], annotations=Annotations(forces=np.ones((3, 2)))
        )


# --- the camera ----------------------------------------------------------------------------------


def test_the_camera_follows_the_robot_and_stops_at_the_end_walls():
    view = view_of(CONFIG, 640, "robot")
    assert 640 / view.scale == pytest.approx(12.0)
    middle = centred(view, CONFIG, 3.0)
    assert abs(middle.place(0.0, 3.0)[0] - 320) <= 0.5
    for far in (13.0, 14.7, 1e300):
        end = centred(view, CONFIG, far)
        assert abs(end.place(0.0, 15.55)[0] - 640) <= 0.5
        assert abs(centred(view, CONFIG, -far).place(0.0, -15.55)[0]) <= 0.5


def test_the_camera_of_the_whole_corridor_never_moves():
    view = view_of(CONFIG, 961)
    assert centred(view, CONFIG, 14.0) == centred(view, CONFIG, -3.0) == view


def test_the_close_up_shows_the_same_things_larger():
    whole, close = (draw_scene(scene(), CONFIG, 640, camera=camera) for camera in CAMERAS)
    assert close.shape[1] == whole.shape[1] == 640
    assert close.shape[0] > 1.5 * whole.shape[0]
    assert close.shape[0] % 16 == 0


def test_what_stands_still_keeps_its_shape_as_the_camera_moves():
    goal = np.array([[0.0, 1.0], [0.0, 500.0]])

    def picture(z):
        shown = Scene((0.0, z, 0.0), PEOPLE[:0], goal, False, False, np.empty((0, 2)))
        return draw_scene(shown, CONFIG, 640, camera="robot")

    view = view_of(CONFIG, 640, "robot")
    first, second = -2.0, -1.3
    shift = round(view.scale * second) - round(view.scale * first)
    left, right = picture(first)[:300, 400:560], picture(second)[:300, 400 - shift : 560 - shift]
    assert np.array_equal(left, right)


@pytest.mark.parametrize(
    "lengths",
    [
        {"half_length": 5.0, "half_width": 20.0, "start_z": -4.0, "goal_z": 4.0},
        {"half_length": 100.0, "half_width": 20.0},
        {"half_length": 5.0, "start_z": -4.0, "goal_z": 4.0, "doorway_width": 1.2},
    ],
)
def test_every_corridor_can_be_seen_close_up(lengths):
    config = CorridorConfig(**lengths)
    picture = draw_scene(scene(), config, 128, camera="robot", overlays=OVERLAYS, annotations=NOTES)
    assert picture.shape[1] == 128
    assert picture.shape[0] < 5 * 128


def test_a_robot_far_away_draws_nothing_and_breaks_nothing():
    gone = scene((1e300, 1e300, 0.0), people=np.array([[1e300, -1e300, 0.0, 0.0, 0.0]]))
    notes = Annotations(rays=np.ones(9), forces=np.ones((1, 2)))
    for camera in CAMERAS:
        picture = draw_scene(gone, CONFIG, 160, camera=camera, overlays=OVERLAYS, annotations=notes)
        assert picture.shape[1] == 160


# --- several pictures ----------------------------------------------------------------------------


@pytest.mark.parametrize("count", [1, 2, 5, 16])
def test_tiles_hold_every_picture_in_order(count):
    frames = [np.full((20, 70, 3), 10 + n, dtype=np.uint8) for n in range(count)]
    whole = tile(frames)
    assert whole.dtype == np.uint8
    assert whole.shape[0] % 16 == whole.shape[1] % 16 == 0
    rows, columns = zip(
        *(np.argwhere(whole[:, :, 0] == 10 + n)[0] for n in range(count)), strict=True
    )
    assert list(zip(rows, columns, strict=True)) == sorted(zip(rows, columns, strict=True))
    for n in range(count):
        assert (whole[:, :, 0] == 10 + n).sum() == 20 * 70


def test_tiles_make_a_nearly_square_picture():
    height, width, _ = tile([np.zeros((100, 300, 3), dtype=np.uint8)] * 12).shape
    assert 0.5 < height / width < 2.0


@pytest.mark.parametrize("shapes", [[], [(4, 4, 3), (4, 5, 3)]])
def test_pictures_that_cannot_be_tiled_are_an_error(shapes):
    with pytest.raises(ValueError, match="frames: expected pictures of one shape"):
        tile([np.zeros(shape, dtype=np.uint8) for shape in shapes])
