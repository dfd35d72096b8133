import numpy as np
import pytest
import torch
from matplotlib.axes import Axes
from PIL import Image

from polite.experiments.map import draw_map, map_figure
from polite.experiments.replication.config import StudyConfig
from polite.experiments.replication.world import FLOOR_X, FLOOR_Z, floor_plan, scene_of
from polite.rewards.files import save_reward_model
from polite.rewards.network import FAST, RewardNet
from polite.types import PoliteError
from socialnav_env import CorridorConfig


def save_model(folder, observations=36, actions=2):
    net = RewardNet(observations, actions, FAST, torch.Generator().manual_seed(0))
    save_reward_model(folder / "reward.pt", net)
    return folder / "reward.pt"


def test_a_png_is_a_picture(tmp_path) -> None:
    out = draw_map(save_model(tmp_path), tmp_path / "deep" / "map.png")
    with Image.open(out) as picture:
        pixels = np.asarray(picture.convert("RGB"))
    assert pixels.shape[1] > 1000
    assert len(np.unique(pixels.reshape(-1, 3), axis=0)) > 200  # a heat map, not a blank


def test_a_pdf_is_a_pdf(tmp_path) -> None:
    assert draw_map(save_model(tmp_path), tmp_path / "map.PDF").read_bytes().startswith(b"%PDF")


def test_profile_and_heat_map_show_the_rewards() -> None:
    floor = floor_plan(StudyConfig())
    figure = map_figure(floor, 0.1 * floor.z + floor.x)
    above: Axes = figure.axes[0]
    below: Axes = figure.axes[1]
    (curve,) = [line for line in above.lines if line.get_label().startswith("mean")]
    z = np.asarray(curve.get_xdata())
    np.testing.assert_allclose(curve.get_ydata(), 0.1 * z, atol=1e-9)  # x is even around 0
    cells = np.asarray(below.collections[0].get_array())
    assert cells.shape == (FLOOR_X, FLOOR_Z)
    assert cells[-1].mean() > cells[0].mean()  # x upwards
    assert cells[:, -1].mean() > cells[:, 0].mean()  # z to the right
    assert below.get_xlim() == above.get_xlim()


def test_the_scene_is_the_corridor_of_the_env() -> None:
    scene, world = scene_of(0.3), CorridorConfig()
    assert scene["goal"] == [0.0, world.goal_z]
    assert len(scene["people"]) == world.num_humans


def test_a_model_of_another_env_is_a_one_line_error(tmp_path) -> None:
    with pytest.raises(PoliteError, match=r"36 observation and 2 action.*17 and 6") as caught:
        draw_map(save_model(tmp_path, 17, 6), tmp_path / "map.png")
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "map.png").exists()


def test_a_missing_model_is_a_one_line_error(tmp_path) -> None:
    with pytest.raises(PoliteError, match="no such reward model"):
        draw_map(tmp_path / "reward.pt", tmp_path / "map.png")


@pytest.mark.parametrize("name", ["map.jpg", "map"])
def test_other_endings_are_refused(tmp_path, name: str) -> None:
    with pytest.raises(PoliteError, match=r"\.png or \.pdf"):
        draw_map(save_model(tmp_path), tmp_path / name)
