import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scenes import bodies_of

from socialnav_env.config import CorridorConfig
from socialnav_env.reward import (
    TERMS,
    proximity_share,
    remaining_way,
    reward,
    reward_parameters,
    rewards_from,
)
from socialnav_env.state import LONG_AGO

CONFIG = CorridorConfig(
    robot_radius=0.3, human_radius=0.3, intermittent_radius=0.8, goal_radius=1.0,
    goal_reward=7.0, intermittent_reward=3.0, collision_penalty=2.0, contact_penalty=0.25,
    contact_memory=0.5, timestep=0.05, frame_skip=2, proximity_penalty=0.4, personal_space=1.2,
    progress_weight=0.5, control_penalty=0.01,
)  # fmt: skip
GOALS = ((-2.5, 0.0), (12.0, 0.0))


class Scorer:
    """The kernel with its state, for one corridor."""

    def __init__(self, config=CONFIG, goals=GOALS):
        self.goals = np.array([goals])
        self.flags = np.zeros((1, 2), dtype=np.bool_)
        self.contact_free = np.array([LONG_AGO])
        self.remaining = np.zeros(1)
        self.row = np.array(reward_parameters(config))
        self.terms, self.collided = np.zeros((1, 6)), np.zeros(1, dtype=np.bool_)
        self.ended = np.zeros(1, dtype=np.bool_)

    def start(self, *robot):
        self.remaining[0] = remaining_way(bodies_of(robot)[0, 0], self.goals[0], self.flags[0])
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


def test_progress_by_hand():
    scorer = Scorer().start(-14.0, 0.0)
    assert scorer.score((-13.0, 0.0))["reward_progress"] == pytest.approx(0.5)
    assert scorer.score((-13.5, 0.0))["reward_progress"] == pytest.approx(-0.25)


def test_the_way_leads_over_the_intermittent_goal_while_it_is_ahead():
    goals, none = np.array([(-2.0, 3.0), (12.0, 3.0)]), np.array([False, False])

    def way(z, x, flags=none):
        return remaining_way(np.array([z, x, 0.0, 0.0, 0.0, 0.0]), goals, np.array(flags))

    assert way(-6.0, 0.0) == pytest.approx(5.0 + 14.0)
    assert way(-6.0, 3.0, (True, False)) == pytest.approx(18.0)
    assert way(8.0, 0.0) == pytest.approx(5.0)
    assert way(8.0, 0.0, (True, True)) == 0.0


steps = st.lists(st.tuples(st.floats(-15.0, 15.0), st.floats(-3.0, 3.0)), min_size=1, max_size=30)


@given(steps)
def test_progress_telescopes_whatever_way_is_taken(way):
    scorer = Scorer().start(-14.0, 0.5)
    first = scorer.remaining[0]
    total = sum(scorer.score(place)["reward_progress"] for place in way)
    assert total == pytest.approx(0.5 * (first - scorer.remaining[0]), abs=1e-9)


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
