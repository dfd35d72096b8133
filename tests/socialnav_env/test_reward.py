import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import bodies_of

from socialnav_env.config import CorridorConfig
from socialnav_env.reward import (
    TERMS,
    effort,
    proximity_share,
    remaining_way,
    reward,
    reward_parameters,
    rewards_from,
    shortest_way,
    way,
)
from socialnav_env.state import LONG_AGO
from socialnav_env.world import World

CONFIG = CorridorConfig(
    robot_radius=0.3, human_radius=0.3, intermittent_radius=0.8, goal_radius=1.0,
    goal_reward=7.0, intermittent_reward=3.0, collision_penalty=2.0, contact_penalty=0.25,
    contact_memory=0.5, timestep=0.05, frame_skip=2, proximity_penalty=0.4, personal_space=1.2,
    progress_weight=0.5, control_penalty=0.01,
)  # fmt: skip
GOALS = ((-2.5, 0.0), (12.0, 0.0))
compiled = settings(deadline=None)


class Scorer:
    """The kernel with its state, for one corridor."""

    def __init__(self, config=CONFIG, goals=GOALS):
        self.goals = np.array([goals])
        self.flags = np.zeros((1, 2), dtype=np.bool_)
        self.contact_free = np.full((1, 2), LONG_AGO)
        self.remaining = np.zeros(1)
        self.row = np.array(reward_parameters(config))
        self.terms, self.collided = np.zeros((1, 6)), np.zeros(1, dtype=np.bool_)
        self.ended = np.zeros(1, dtype=np.bool_)

    def start(self, *robot):
        body = bodies_of(robot)[0, 0]
        self.remaining[0] = remaining_way(body, self.goals[0], self.flags[0], self.row)
        return self

    def score(self, robot, people=(), action=(-1.0, 0.0), person=False, wall=False):
        reward(
            bodies_of(robot, people), self.goals, self.flags, np.array([[person, wall]]),
            np.array([action]), self.contact_free, self.remaining, self.row, self.terms,
            self.collided, self.ended,
        )  # fmt: skip
        return dict(zip(TERMS, self.terms[0].tolist(), strict=True))


def test_a_row_of_numbers_gives_the_parameters_back():
    assert rewards_from(np.array(reward_parameters(CONFIG))) == reward_parameters(CONFIG)


def test_the_end_goal_pays_once():
    scorer = Scorer()
    assert scorer.score((10.9, 0.0))["reward_goal"] == 0.0
    assert scorer.score((11.0, 0.0))["reward_goal"] == 7.0
    assert scorer.score((12.0, 0.0))["reward_goal"] == 0.0
    scorer.score((0.0, 0.0))
    assert scorer.score((12.0, 0.0))["reward_goal"] == 0.0
    assert scorer.flags.tolist() == [[False, True]]


def test_the_intermittent_goal_pays_once():
    scorer = Scorer()
    assert scorer.score((-2.5, 0.81))["reward_intermittent"] == 0.0
    assert scorer.score((-2.5, 0.79))["reward_intermittent"] == 3.0
    assert scorer.score((-2.5, 0.0))["reward_intermittent"] == 0.0
    assert scorer.flags.tolist() == [[True, False]]


def test_who_leans_on_a_wall_can_still_run_into_a_person():
    scorer = Scorer()
    paid, begun = [], []
    for person in [False] * 3 + [True, True] + [False] * 3:
        paid.append(scorer.score((0.0, 0.0), wall=True, person=person)["reward_collision"])
        begun.append(bool(scorer.collided[0]))
    assert paid == [-2.0, -0.25, -0.25, -2.0, *[-0.25] * 4]
    assert begun == [True, False, False, True, *[False] * 4]


def test_both_at_once_are_one_collision():
    scorer = Scorer()
    assert scorer.score((0.0, 0.0), wall=True, person=True)["reward_collision"] == -2.0
    assert scorer.score((0.0, 0.0), wall=True, person=True)["reward_collision"] == -0.25


def test_a_goal_behind_the_doorways_wall_is_not_reached_through_it():
    config = dataclasses.replace(CONFIG, doorway_width=1.8, doorway_z=2.0)
    goals = ((2.5, -2.0), (2.5, 2.0))
    scorer = Scorer(config, goals).start(1.6, 2.0)
    assert scorer.score((1.6, 2.0))["reward_goal"] == 0.0
    assert scorer.score((1.6, -2.0))["reward_intermittent"] == 0.0
    assert scorer.score((2.4, 2.0))["reward_goal"] == 7.0
    assert scorer.score((2.4, -2.0))["reward_intermittent"] == 3.0


def test_a_collision_is_paid_when_it_begins_and_contact_while_it_lasts():
    scorer = Scorer()
    paid, begun = [], []
    for contact in [False, True, True, *[False] * 4, True, *[False] * 5, True]:
        paid.append(scorer.score((0.0, 0.0), person=contact)["reward_collision"])
        begun.append(bool(scorer.collided[0]))
    # four steps apart is the same collision at a memory of .5 s, five steps apart another
    assert paid == [0.0, -2.0, -0.25, *[0.0] * 4, -0.25, *[0.0] * 5, -2.0]
    assert begun == [value == -2.0 for value in paid]


@pytest.mark.parametrize(("person", "wall"), [(True, False), (False, True), (True, True)])
def test_people_and_walls_count_alike_and_once(person, wall):
    assert Scorer().score((0.0, 0.0), person=person, wall=wall)["reward_collision"] == -2.0


def test_proximity_by_hand():
    # centres 1.2 m apart: gap .6, half of the personal space; the other one is outside of it
    near, far = (1.2, 0.0), (0.0, 1.8)
    assert Scorer().score((0.0, 0.0), [near])["reward_proximity"] == pytest.approx(-0.2)
    assert Scorer().score((0.0, 0.0), [far])["reward_proximity"] == pytest.approx(0.0)
    assert Scorer().score((0.0, 0.0), [near, near])["reward_proximity"] == pytest.approx(-0.4)


def test_the_share_of_proximity():
    assert proximity_share(0.0, 1.2) == 1.0
    assert proximity_share(-0.1, 1.2) == 1.0
    assert proximity_share(0.3, 1.2) == pytest.approx(0.75)
    assert proximity_share(1.2, 1.2) == 0.0
    assert proximity_share(0.0, 0.0) == 0.0  # no personal space, no penalty


def test_control_by_hand():
    # full speed costs 1, half turn rate .25
    assert Scorer().score((0, 0), action=(1.0, 0.5))["reward_control"] == pytest.approx(-0.0125)
    assert Scorer().score((0, 0), action=(-1.0, 0.0))["reward_control"] == 0.0


def test_control_of_a_holonomic_base_by_hand():
    scorer = Scorer()
    # the shares of top speed are squared and summed, at most 1; half turn rate costs .25
    for action, cost in [
        ((0.0, 0.0, 0.0), 0.0),
        ((-0.6, 0.0, 0.0), 0.36),
        ((0.6, -0.6, 0.5), 0.97),
        ((1.0, 1.0, 1.0), 2.0),
    ]:
        paid = scorer.score((0.0, 0.0), action=action)["reward_control"]
        assert paid == pytest.approx(-0.01 * cost)


@compiled
@given(st.tuples(*[st.floats(-1.0, 1.0)] * 3))
def test_effort_is_that_of_the_velocity_which_the_action_brings_about(action):
    ahead, left, turn = action
    speed = min(math.hypot(ahead, left), 1.0)
    assert effort(np.array(action)) == pytest.approx(speed**2 + turn**2)
    forward = effort(np.array([ahead, turn]))
    assert forward == pytest.approx((0.5 * (ahead + 1.0)) ** 2 + turn**2)


def test_progress_by_hand():
    scorer = Scorer().start(-14.0, 0.0)
    assert scorer.score((-13.0, 0.0))["reward_progress"] == pytest.approx(0.5)
    assert scorer.score((-13.5, 0.0))["reward_progress"] == pytest.approx(-0.25)


def test_the_way_leads_over_the_intermittent_goal_while_it_is_ahead():
    goals, none = np.array([(-2.0, 3.0), (12.0, 3.0)]), np.array([False, False])

    def left(z, x, flags=none):
        body, row = np.array([z, x, 0.0, 0.0, 0.0, 0.0]), np.array(reward_parameters(CONFIG))
        return remaining_way(body, goals, np.array(flags), row)

    assert left(-6.0, 0.0) == pytest.approx(5.0 + 14.0)
    assert left(-6.0, 3.0, (True, False)) == pytest.approx(18.0)
    assert left(8.0, 0.0) == pytest.approx(5.0)
    assert left(8.0, 0.0, (True, True)) == 0.0


DOOR = dataclasses.replace(CONFIG, doorway_width=1.8, doorway_z=2.0)
steps = st.lists(st.tuples(st.floats(-15.0, 15.0), st.floats(-3.0, 3.0)), min_size=1, max_size=30)


@compiled
@given(steps, st.sampled_from([CONFIG, DOOR]))
def test_progress_telescopes_whatever_way_is_taken(places, config):
    scorer = Scorer(config).start(-14.0, 0.5)
    first = scorer.remaining[0]
    total = sum(scorer.score(place)["reward_progress"] for place in places)
    assert total == pytest.approx(0.5 * (first - scorer.remaining[0]), abs=1e-9)
    body = bodies_of(places[-1])[0, 0]
    left = remaining_way(body, scorer.goals[0], scorer.flags[0], scorer.row)
    assert scorer.remaining[0] == left


# --- the way through a doorway -------------------------------------------------------------------

DOOR_P = reward_parameters(DOOR)


def test_the_way_through_a_doorway_by_hand():
    # the robot's centre has .9 - .3 = .6 m to each side of the middle of the opening at z = 2
    assert way(-1.0, -1.0, 5.0, 1.0, DOOR_P) == pytest.approx(math.hypot(6.0, 2.0))  # straight
    assert way(-2.0, 2.6, 5.0, 2.6, DOOR_P) == pytest.approx(math.hypot(4, 2) + math.hypot(3, 2))
    assert way(5.0, -2.6, -2.0, -0.6, DOOR_P) == pytest.approx(math.hypot(3.0, 2.0) + 4.0)
    assert way(-2.0, 2.6, 1.0, -2.0, DOOR_P) == pytest.approx(math.hypot(3.0, 4.6))  # on this side
    assert way(3.0, 2.6, 5.0, -2.0, DOOR_P) == pytest.approx(math.hypot(2.0, 4.6))  # on the other
    no_wall = reward_parameters(CONFIG)
    assert way(-2.0, 2.6, 5.0, 2.6, no_wall) == pytest.approx(7.0)


places = st.floats(-14.0, 14.0), st.floats(-2.7, 2.7)


@compiled
@given(*places, *places)
def test_no_way_through_the_doorway_is_shorter(z, x, to_z, to_x):
    length = way(z, x, to_z, to_x, DOOR_P)
    if (z < 2.0 < to_z) or (to_z < 2.0 < z):
        doors = np.linspace(-0.6, 0.6, 2001)
        ways = np.hypot(2.0 - z, doors - x) + np.hypot(to_z - 2.0, to_x - doors)
        assert length <= ways.min() + 1e-12
        assert length == pytest.approx(ways.min(), abs=1e-3)
    else:
        assert length == pytest.approx(math.hypot(to_z - z, to_x - x))


@compiled
@given(*places, *places)
def test_the_way_back_is_as_long(z, x, to_z, to_x):
    there, back = way(z, x, to_z, to_x, DOOR_P), way(to_z, to_x, z, x, DOOR_P)
    assert there == pytest.approx(back)
    assert way(z, -x, to_z, -to_x, DOOR_P) == pytest.approx(there)


def test_the_whole_way_leads_through_the_doorway_twice_where_the_goals_lie_so():
    goals, none = np.array([(4.0, 2.6), (-4.0, 2.6)]), np.zeros(2, dtype=np.bool_)
    row = np.array(DOOR_P)
    body = bodies_of((-4.0, 0.6))[0, 0]
    back = math.hypot(2.0, 2.0) + math.hypot(6.0, 2.0)
    assert remaining_way(body, goals, none, row) == pytest.approx(6.0 + math.hypot(2, 2) + back)
    assert shortest_way(body, goals[1], row) == pytest.approx(2.0)
    assert shortest_way(body, goals[0], row) == pytest.approx(6.0 + math.hypot(2.0, 2.0))


def test_in_a_doorway_corridor_progress_sums_to_the_metres_gained():
    config = CorridorConfig.from_keywords(
        "doorway", num_humans=0, terminate_on_collision=False, progress_weight=0.5
    )
    world, column = World(config, 6), TERMS.index("reward_progress")
    for n in range(6):
        world.begin(n, np.random.default_rng(n))
    first, total = world.state.remaining.copy(), np.zeros(6)
    for _ in range(450):
        z, x, angle = world.state.bodies[:, 0, :3].T
        aim_x = np.where(z < config.doorway_z, 0.0, world.state.goals[:, 1, 1])
        turn = np.clip(2.0 * (np.arctan2(aim_x - x, 1.5) - angle), -1.0, 1.0)
        world.act(np.stack([np.ones(6), turn], axis=1))
        total += world.terms[:, column]
    assert world.state.flags[:, 1].all()  # everybody got through, and there
    np.testing.assert_allclose(total, 0.5 * (first - world.state.remaining), atol=1e-9)
    np.testing.assert_array_equal(world.state.remaining, 0.0)


@pytest.mark.parametrize("on_goal", [True, False])
@pytest.mark.parametrize("on_collision", [True, False])
def test_what_ends_an_episode_is_a_setting(on_goal, on_collision):
    config = CorridorConfig(terminate_on_goal=on_goal, terminate_on_collision=on_collision)
    scorer = Scorer(config)
    scorer.score((0.0, 0.0))
    assert not scorer.ended[0]
    scorer.score((0.0, 0.0), wall=True)
    assert scorer.ended[0] == on_collision
    scorer.score((12.0, 0.0))
    assert scorer.ended[0] == on_goal
