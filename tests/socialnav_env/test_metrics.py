import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import bodies_of

from socialnav_env.config import CorridorConfig
from socialnav_env.metrics import (
    METRICS,
    NO_ONE,
    NUM_TALLIES,
    STRAIGHT,
    TIME_HORIZON,
    count_step,
    metric_parameters,
    metrics_from,
    start_tallies,
    summarise,
    time_to_touch,
)
from socialnav_env.world import World

CONFIG = CorridorConfig(
    timestep=0.05, frame_skip=2, robot_radius=0.3, human_radius=0.3, goal_radius=1.0,
    personal_space=1.2,
)  # fmt: skip
ROW = np.array(metric_parameters(CONFIG))


class Episode:
    """The kernels with their state, for one corridor; dt is .1 s."""

    def __init__(self, robot, goal=(12.0, 0.0)):
        self.flags = np.zeros((1, 2), dtype=np.bool_)
        self.tallies = np.zeros((1, NUM_TALLIES))
        way = math.hypot(goal[0] - robot[0], goal[1] - robot[1])
        start_tallies(bodies_of(robot)[0, 0], way, ROW, self.tallies[0])

    def step(self, robot, people=(), person=False, wall=False, collided=False):
        count_step(
            bodies_of(robot, people), self.flags, np.array([[person, wall]]),
            np.array([collided]), ROW, self.tallies,
        )  # fmt: skip
        return self

    @property
    def metrics(self):
        out = np.zeros((1, len(METRICS)))
        summarise(self.tallies, self.flags, ROW, out)
        return dict(zip(METRICS, out[0].tolist(), strict=True))


def test_a_row_of_numbers_gives_the_parameters_back():
    assert metrics_from(ROW) == metric_parameters(CONFIG)


def test_the_start_of_an_episode():
    metrics = Episode((0.0, 0.0)).metrics
    assert metrics["min_human_distance"] == NO_ONE
    assert metrics["min_time_to_collision"] == TIME_HORIZON
    assert metrics["personal_space_compliance"] == metrics["public_share"] == 1.0
    others = set(METRICS) - {
        "min_human_distance", "min_time_to_collision", "personal_space_compliance", "public_share",
    }  # fmt: skip
    assert all(metrics[name] == 0.0 for name in others)


def test_collisions_and_steps_in_contact():
    episode = Episode((0.0, 0.0))
    episode.step((0.0, 0.0), person=True, collided=True).step((0.0, 0.0), person=True)
    episode.step((0.0, 0.0), person=True, wall=True).step((0.0, 0.0))
    metrics = episode.metrics
    assert metrics["human_collisions"] == 3.0
    assert metrics["wall_collisions"] == 1.0
    assert metrics["collisions"] == 1.0


def test_success_time_to_goal_and_the_intermittent_goal():
    episode = Episode((0.0, 0.0)).step((0.1, 0.0)).step((0.2, 0.0))
    assert episode.metrics["success"] == episode.metrics["intermittent"] == 0.0
    assert episode.metrics["time_to_goal"] == pytest.approx(0.2)
    episode.flags[0] = True
    episode.step((0.3, 0.0)).step((0.4, 0.0)).step((0.5, 0.0))
    assert episode.metrics["success"] == episode.metrics["intermittent"] == 1.0
    assert episode.metrics["time_to_goal"] == pytest.approx(0.3)


def test_path_length_and_spl_by_hand():
    # straight way 5 - 1 = 4 m to the goal's edge; the way taken is 3 + 4 = 7 m
    episode = Episode((0.0, 0.0), goal=(3.0, 4.0)).step((3.0, 0.0))
    assert episode.metrics["spl"] == 0.0
    episode.flags[0, 1] = True
    episode.step((3.0, 4.0))
    assert episode.metrics["path_length"] == pytest.approx(7.0)
    assert episode.metrics["spl"] == pytest.approx(4.0 / 7.0)
    episode.step((3.0, 0.0))  # whatever follows: the goal has been reached in seven metres
    assert episode.metrics["path_length"] == pytest.approx(11.0)
    assert episode.metrics["spl"] == pytest.approx(4.0 / 7.0)


def test_spl_is_at_most_one():
    episode = Episode((0.0, 0.0), goal=(5.0, 0.0))
    episode.flags[0, 1] = True
    episode.step((2.0, 0.0))
    assert episode.metrics["spl"] == 1.0
    at_goal = Episode((0.0, 0.0), goal=(0.5, 0.0))
    at_goal.flags[0, 1] = True
    at_goal.step((0.0, 0.0))
    assert at_goal.metrics["spl"] == 1.0


def test_spl_counts_the_way_through_the_doorway():
    config = CorridorConfig(
        num_humans=0, start_z=1.0, goal_z=3.0, doorway_z=2.0, doorway_width=1.2, anchor_jitter=2.5
    )
    longer = []
    for seed in range(20):
        world = World(config, 1)
        world.begin(0, np.random.default_rng(seed))
        (z, x), (to_z, to_x) = world.state.bodies[0, 0, :2], world.state.goals[0, 1]
        direct, shortest = math.hypot(to_z - z, to_x - x), world.state.tallies[0, STRAIGHT]
        doors = np.linspace(-0.3, 0.3, 2001)  # for the robot's centre
        ways = np.hypot(2.0 - z, doors - x) + np.hypot(to_z - 2.0, to_x - doors)
        expected = ways.min() if to_z > 2.0 else direct
        assert shortest == pytest.approx(max(expected - config.goal_radius, 0.0), abs=1e-6)
        longer.append(shortest > direct - config.goal_radius + 0.01)
    assert any(longer) and not all(longer)


def test_stalled_time():
    episode = Episode((0.0, 0.0))
    for speed in (0.0, 0.04, 0.06, 0.5):
        episode.step((0.0, 0.0, 0.0, speed * 0.6, speed * 0.8))
    assert episode.metrics["stalled_time"] == pytest.approx(0.2)


def test_distance_to_people_and_personal_space():
    episode = Episode((0.0, 0.0))
    episode.step((0.0, 0.0), [(3.0, 4.0), (0.0, 2.0)])  # gaps 4.4 and 1.4
    assert episode.metrics["min_human_distance"] == pytest.approx(1.4)
    assert episode.metrics["personal_space_compliance"] == 1.0
    episode.step((0.0, 0.0), [(3.0, 4.0), (0.0, 1.0)])  # .4
    episode.step((0.0, 0.0), [(3.0, 4.0), (0.0, 2.5)])
    episode.step((0.0, 0.0), [(3.0, 4.0), (0.0, 2.5)])
    assert episode.metrics["min_human_distance"] == pytest.approx(0.4)
    assert episode.metrics["personal_space_compliance"] == pytest.approx(0.75)


BANDS = ("intimate_share", "personal_share", "social_share", "public_share")


@pytest.mark.parametrize(
    ("gap", "band"),
    [
        (-0.1, 0), (0.0, 0), (0.44, 0), (0.46, 1), (1.19, 1), (1.21, 2), (3.59, 2), (3.61, 3),
        (20.0, 3),
    ],
)  # fmt: skip
def test_the_bands_of_distance_by_hand(gap, band):
    episode = Episode((0.0, 0.0))
    episode.step((0.0, 0.0), [(0.0, 25.0), (0.6 * (gap + 0.6), -0.8 * (gap + 0.6))])
    assert [episode.metrics[name] for name in BANDS] == np.eye(4)[band].tolist()


def test_shares_of_the_bands_over_an_episode_by_hand():
    episode = Episode((0.0, 0.0))
    for gap in (0.2, 0.5, 0.6, 1.0, 2.0, 2.0, 4.0, 9.0):
        episode.step((0.0, 0.0), [(gap + 0.6, 0.0)])
    shares = [episode.metrics[name] for name in BANDS]
    assert shares == pytest.approx([0.125, 0.375, 0.25, 0.25])
    # where personal space ends with its band, keeping out of it is the rest
    assert episode.metrics["personal_space_compliance"] == pytest.approx(sum(shares[2:]))


@settings(deadline=None)
@given(st.lists(st.lists(st.tuples(*[st.floats(-9.0, 9.0)] * 2), max_size=3), max_size=20))
def test_shares_of_the_bands_sum_to_one(crowds):
    episode = Episode((0.0, 0.0))
    for people in crowds:
        episode.step((0.0, 0.0), people)
    shares = [episode.metrics[name] for name in BANDS]
    assert sum(shares) == pytest.approx(1.0)
    assert all(-1e-12 <= share <= 1.0 for share in shares)


def test_with_nobody_there_all_is_public():
    assert Episode((0.0, 0.0)).step((0.0, 0.0)).metrics["public_share"] == 1.0


def test_an_overlap_is_distance_zero():
    assert Episode((0.0, 0.0)).step((0.0, 0.0), [(0.5, 0.0)]).metrics["min_human_distance"] == 0.0


def test_time_to_collision_of_the_nearest_approach():
    episode = Episode((0.0, 0.0))
    # 5 m apart, .6 m of radii, closing at 1 + .1 m/s; another one walks away
    episode.step((0.0, 0.0, 0.0, 0.1, 0.0), [(5.0, 0.0, 0.0, -1.0, 0.0), (0.0, 1.0, 0.0, 0.0, 1.0)])
    assert episode.metrics["min_time_to_collision"] == pytest.approx(4.4 / 1.1)
    episode.step((0.0, 0.0), [(9.0, 0.0), (9.0, 1.0)])
    assert episode.metrics["min_time_to_collision"] == pytest.approx(4.4 / 1.1)


def test_time_to_touch_by_hand():
    assert time_to_touch(0.5, 0.0, 1.0, 0.0, 0.6) == 0.0  # they touch
    assert time_to_touch(2.0, 0.0, 1.0, 0.0, 0.6) == TIME_HORIZON  # it goes away
    assert time_to_touch(2.0, 1.0, -1.0, 0.0, 0.6) == TIME_HORIZON  # it passes
    assert time_to_touch(2.0, 0.0, -0.1, 0.0, 0.6) == TIME_HORIZON  # it takes 14 s
    # it grazes: aside by .36, so that it touches .48 before it is level
    assert time_to_touch(2.0, 0.36, -1.0, 0.0, 0.6) == pytest.approx(1.52)


@settings(deadline=None)
@given(st.floats(0.7, 5.0), st.floats(-3.0, 3.0), st.floats(-2.0, 2.0), st.floats(-2.0, 2.0))
def test_at_the_time_to_touch_they_touch(dz, dx, vz, vx):
    time = time_to_touch(dz, dx, vz, vx, 0.6)
    if time < TIME_HORIZON:
        assert math.hypot(dz + time * vz, dx + time * vx) == pytest.approx(0.6, abs=1e-6)


def test_speed_acceleration_and_jerk_by_hand():
    # velocities along z .2, .5, .5, then .3 to the side: dt is .1
    episode = Episode((0.0, 0.0))
    for velocity in [(0.2, 0.0), (0.5, 0.0), (0.5, 0.0), (0.5, 0.3)]:
        episode.step((0.0, 0.0, 0.0, *velocity))
    speeds = [0.2, 0.5, 0.5, math.hypot(0.5, 0.3)]
    accelerations = [2.0, 3.0, 0.0, 3.0]
    jerks = [10.0, 30.0, 30.0]  # none is known in the first step
    metrics = episode.metrics
    assert metrics["speed_mean"] == pytest.approx(np.mean(speeds))
    assert metrics["speed_max"] == pytest.approx(max(speeds))
    assert metrics["acceleration_mean"] == pytest.approx(np.mean(accelerations))
    assert metrics["acceleration_max"] == pytest.approx(3.0)
    assert metrics["jerk_mean"] == pytest.approx(np.mean(jerks))
    assert metrics["jerk_max"] == pytest.approx(30.0)


def test_path_irregularity_by_hand():
    episode = Episode((0.0, 0.0, 0.1))
    for robot in [(1.0, 0.0, 0.3), (2.0, 0.0, -0.1), (2.0, 2.0, -0.1)]:
        episode.step(robot)
    assert episode.metrics["path_irregularity"] == pytest.approx((0.2 + 0.4) / 4.0)


def test_turning_on_the_spot_has_no_irregularity_per_metre():
    assert Episode((0.0, 0.0)).step((0.0, 0.0, 1.0)).metrics["path_irregularity"] == 0.0


def test_corridors_are_counted_apart():
    tallies, flags = np.zeros((2, NUM_TALLIES)), np.zeros((2, 2), dtype=np.bool_)
    bodies = np.concatenate([bodies_of((0.0, 0.0)), bodies_of((1.0, 1.0))])
    for body, tally in zip(bodies, tallies, strict=True):
        start_tallies(body[0], 12.0, ROW, tally)
    bodies[1, 0, 0] += 0.5
    none = np.zeros((2, 2), dtype=np.bool_)
    count_step(bodies, flags, none, np.array([False, True]), ROW, tallies)
    out = np.zeros((2, len(METRICS)))
    summarise(tallies, flags, ROW, out)
    names = list(METRICS)
    np.testing.assert_allclose(out[:, names.index("path_length")], [0.0, 0.5])
    np.testing.assert_allclose(out[:, names.index("collisions")], [0.0, 1.0])


def test_every_metric_has_a_definition():
    assert all(METRICS.values())


def test_a_jump_is_no_jerk():
    """Before a jump there was another motion: the first difference after it says nothing."""
    world = World(CorridorConfig(num_humans=0), 1)
    world.begin(0, np.random.default_rng(0))
    ahead = np.array([[1.0, 0.0]])
    for _ in range(20):
        world.step(ahead)
    jerk = list(METRICS).index("jerk_max")
    smooth = world.metrics[0, jerk]
    bodies = world.state.bodies[0].copy()
    bodies[0, 3:5] = 0.0
    world.place(0, bodies)
    world.step(np.array([[-1.0, 0.0]]))
    assert world.metrics[0, jerk] == smooth
