"""Where any saved reward model pays in the corridor, as one picture."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure

from polite.analysis.reward_map import map_2d_part, profile
from polite.experiments.replication.config import StudyConfig
from polite.experiments.replication.world import FLOOR_X, FLOOR_Z, MapStates, floor_plan, scene_of
from polite.files import write_atomically
from polite.plots.map_2d import draw_map_2d, shared_limits
from polite.plots.reward_map import REWARD, draw_profile
from polite.plots.scene import floor_handles
from polite.plots.style import STYLE, WIDTH, panel_letters
from polite.rewards.files import load_reward_model
from polite.rewards.network import RewardModel, predict
from polite.types import PoliteError
from socialnav_env import CorridorConfig

ENDINGS = (".png", ".pdf")


def draw_map(model: Path, out: Path) -> Path:
    """Draw a reward model along the corridor and on its floor.

    The robot drives ahead at full speed, in every cell of the floor in turn; the people stand
    still, beside the middle. Walls, goals and people are drawn in.

    Args:
        model: a file that `save_reward_model` wrote.
        out: the picture, .png or .pdf.

    Returns:
        The picture's path.

    Raises:
        PoliteError: if the model is missing, damaged or not one of the corridor, or the picture's
            ending is another.
    """
    if out.suffix.lower() not in ENDINGS:
        raise PoliteError(f"{out}: expected a picture that ends in {' or '.join(ENDINGS)}")
    net, states = load_reward_model(model), floor_plan(StudyConfig())
    _check_fits(model, net, states)
    rewards = predict(net, states.observations, states.actions).astype(np.float64)
    with rc_context(STYLE):
        figure = map_figure(states, rewards)
        write_atomically(out, figure.savefig)
    return out


def map_figure(states: MapStates, rewards: np.ndarray[Any, np.dtype[np.float64]]) -> Figure:
    """The profile along z above the heat map of x and z.

    Args:
        states: (M,) places on the floor.
        rewards: (M,) what the model pays there.
    """
    world = CorridorConfig()
    z_edges = np.linspace(-world.half_length, world.half_length, FLOOR_Z + 1)
    x_edges = np.linspace(-world.half_width, world.half_width, FLOOR_X + 1)
    along = profile(states.z, rewards[None], z_edges).as_json("z")
    floor = map_2d_part(states.x, states.z, rewards[None], x_edges, z_edges)
    figure = Figure(figsize=(WIDTH, 5.0))
    above, below = figure.subplots(2, 1, sharex=True)
    scene = scene_of(world.human_radius)  # people stand still: a band as wide as a body
    draw_profile(above, along, scene)
    mesh = draw_map_2d(below, floor, scene, shared_limits({"": floor}))
    below.set_xlabel("robot's position along the corridor z [m]")
    figure.colorbar(mesh, ax=below, label=REWARD, extend="both", location="bottom", aspect=50)
    panel_letters([above, below])
    figure.legend(handles=floor_handles(), loc="outside lower center", ncols=3)
    return figure


def _check_fits(model: Path, net: RewardModel, states: MapStates) -> None:
    """Refuse a model of another env.

    Raises:
        PoliteError: with the shapes expected and seen.
    """
    expected = states.observations.shape[1], states.actions.shape[1]
    seen = net.observation_size, net.action_size
    if seen != expected:
        raise PoliteError(
            f"{model}: expected a reward model of the corridor, with {expected[0]} observation and "
            f"{expected[1]} action entries; this one has {seen[0]} and {seen[1]}"
        )
