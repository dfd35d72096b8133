import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from socialnav_env.config import ConfigError, CorridorConfig
from socialnav_env.layout import (
    NUM_WAYPOINTS,
    PAPER_ANCHORS,
    START_CLEARANCE,
    WALL_CLEARANCE,
    draw_layout,
)

configs = st.builds(
    CorridorConfig,
    num_humans=st.integers(0, 12),
    half_width=st.floats(1.5, 5.0),
    anchor_jitter=st.floats(0.0, 10.0),
    human_roam=st.floats(0.0, 30.0),
    human_radius=st.floats(0.1, 0.4),
    robot_radius=st.floats(0.1, 0.4),
)
seeds = st.integers(0, 2**32)


def draw(config, seed):
    return draw_layout(config, np.random.default_rng(seed))


@settings(deadline=None)
@given(configs, seeds)
def test_nobody_overlaps_at_the_start(config, seed):
    layout = draw(config, seed)
    centres = np.vstack([layout.robot[:2], layout.people[:, :2]])
    radii = np.array([config.robot_radius] + [config.human_radius] * config.num_humans)
    distances = np.linalg.norm(centres[:, None] - centres[None], axis=-1)
    gaps = distances - radii[:, None] - radii[None]
    assert (gaps[~np.eye(len(gaps), dtype=bool)] >= START_CLEARANCE).all()


@settings(deadline=None)
@given(configs, seeds)
def test_everything_lies_inside(config, seed):
    layout = draw(config, seed)
    edge = np.array([config.half_length, config.half_width]) - WALL_CLEARANCE + 1e-12
    robot, human = edge - config.robot_radius, edge - config.human_radius
    assert (np.abs(layout.robot[:2]) <= robot).all()
    assert (np.abs(layout.goals) <= robot).all()
    assert (np.abs(layout.people[:, :2]) <= human).all()
    assert (np.abs(layout.waypoints) <= human).all()


@settings(deadline=None)
@given(configs, seeds)
def test_equal_seeds_give_equal_layouts(config, seed):
    first, second = draw(config, seed), draw(config, seed)
    for item in dataclasses.fields(first):
        assert np.array_equal(getattr(first, item.name), getattr(second, item.name))


def test_other_seeds_give_other_layouts():
    assert len({draw(CorridorConfig(), seed).robot[0] for seed in range(20)}) == 20


@settings(deadline=None)
@given(seeds)
def test_the_start_is_where_the_docstring_says(seed):
    config = CorridorConfig(anchor_jitter=1.0, human_roam=1.5)
    layout = draw(config, seed)
    assert abs(layout.robot[0] - config.start_z) <= 0.5
    assert abs(layout.robot[1]) <= 1.0
    assert abs(layout.robot[2]) <= 0.3
    assert abs(layout.goals[0, 0] - config.intermittent_z) <= 1.0
    assert abs(layout.goals[1, 0] - config.goal_z) <= 1.0
    assert (np.abs(layout.goals[:, 1]) <= 1.0).all()
    ways = layout.waypoints[:, :, 0] - np.array(PAPER_ANCHORS)[:, None]
    assert (np.abs(ways) <= 2.5 + 1e-12).all()


@settings(deadline=None)
@given(configs, seeds)
def test_people_set_out_at_their_preferred_speed_towards_their_first_waypoint(config, seed):
    layout = draw(config, seed)
    assert layout.waypoints.shape == (config.num_humans, NUM_WAYPOINTS, 2)
    assert (1.3 * layout.speeds <= config.human_top_speed + 1e-12).all()
    assert (layout.speeds >= 0.05).all()
    velocities = layout.people[:, 2:]
    np.testing.assert_allclose(np.linalg.norm(velocities, axis=1), layout.speeds, rtol=1e-9)
    ways = layout.waypoints[:, 0] - layout.people[:, :2]
    across = ways[:, 0] * velocities[:, 1] - ways[:, 1] * velocities[:, 0]
    np.testing.assert_allclose(across, 0.0, atol=1e-9)
    assert ((ways * velocities).sum(axis=1) >= 0.0).all()


@settings(deadline=None)
@given(seeds)
def test_waypoints_lie_on_alternate_sides(seed):
    sides = np.sign(draw(CorridorConfig(), seed).waypoints[:, :, 1])
    assert (sides[:, 1:] == -sides[:, :-1]).all()


def test_a_corridor_too_small_for_its_people_is_an_error():
    config = CorridorConfig(
        half_length=5.0, half_width=1.5, human_radius=1.0, num_humans=12,
        start_z=-4.0, intermittent_z=0.0, goal_z=4.0,
    )  # fmt: skip
    with pytest.raises(ConfigError, match="num_humans=12: no free place"):
        draw(config, 0)
