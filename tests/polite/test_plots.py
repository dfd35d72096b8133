"""Figures: what is drawn where, on synthetic numbers."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from fake_results import SCENE, fake_results
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from polite.plots.curves import draw_seed_band, draw_seeds
from polite.plots.divergence import draw_divergence
from polite.plots.map_2d import draw_map_2d, shared_limits, standard_scores
from polite.plots.reward_map import draw_offset, draw_reward_map
from polite.plots.scene import draw_along, draw_floor
from polite.plots.strip import draw_strip, draw_timeline, example_windows
from polite.plots.style import LOOKS, STYLE
from polite.report import figures


@pytest.fixture(scope="module")
def results() -> dict[str, Any]:
    return fake_results()


@pytest.fixture
def ax() -> Axes:
    return Figure().subplots()


def test_looks_differ_in_more_than_colour() -> None:
    looks = list(LOOKS.values())
    for feature in ("colour", "label"):
        assert len({getattr(look, feature) for look in looks}) == len(looks)
    assert len({(look.line, look.marker) for look in looks}) == len(looks)


def test_reward_map_draws_the_stored_means(ax: Axes, results: dict[str, Any]) -> None:
    draw_reward_map(ax, results["reward_map"], SCENE)
    drawn = {line.get_label(): line for line in ax.lines}
    for name in ("polite", "baseline"):
        line = drawn[LOOKS[name].label]
        np.testing.assert_allclose(line.get_ydata(), results["reward_map"][name]["mean"])
    assert "[m]" in ax.get_xlabel()


def test_scene_is_named_where_it_lies(ax: Axes) -> None:
    draw_along(ax, SCENE)
    places = {(text.get_position()[0], text.get_text().replace("\n", " ")) for text in ax.texts}
    assert places == {
        (-2.5, "intermittent goal"),
        (12.0, "end goal"),
        (-10.0, "person"),
        (5.0, "person"),
        (8.0, "person"),
    }


def test_floor_plan_shows_x_upwards_and_z_to_the_right(ax: Axes) -> None:
    draw_floor(ax, SCENE)
    people = [line.get_xydata()[0].tolist() for line in ax.lines if line.get_mfc() == "#1A1A1A"]
    assert people == [[z, x] for x, z in SCENE["people"]]
    low, high = ax.get_ylim()
    assert low < high


def test_heat_map_cells_lie_where_they_were_counted(ax: Axes) -> None:
    part = {"x": [-1.0, 1.0], "z": [0.5, 1.5], "mean": [[1.0, None], [3.0, 4.0]]}
    mesh = draw_map_2d(ax, part, SCENE, (0, 5))
    cells = np.ma.asarray(mesh.get_array())
    assert cells.shape == (2, 2)
    assert cells[0].tolist() == [1.0, 3.0]  # x = −1, along z
    assert cells[1].tolist() == [None, 4.0]
    corners = np.asarray(mesh.get_coordinates())
    assert corners[0, 0].tolist() == [0.0, -2.0]
    assert corners[-1, -1].tolist() == [2.0, 2.0]


def test_colour_scale_is_shared_and_standard_scores_have_none() -> None:
    parts = {"polite": {"mean": [[0.0, 1.0]]}, "baseline": {"mean": [[0.4, None]]}}
    low, high = shared_limits(parts)
    assert 0 <= low < 0.1 < 0.9 < high <= 1
    scores = standard_scores(np.array([[1.0, 3.0], [np.nan, 5.0]]))
    assert np.nanmean(scores) == pytest.approx(0.0)
    assert np.nanstd(scores) == pytest.approx(1.0)
    assert not standard_scores(np.ones((2, 2))).any()


def test_offset_panel_hatches_people_only(ax: Axes, results: dict[str, Any]) -> None:
    draw_offset(ax, results["person_offset"], 1.2, goal=False, reach=4.0)
    assert [patch.get_hatch() for patch in ax.patches] == ["/////"]


def test_band_of_one_seed_is_left_out_but_its_curve_is_drawn(ax: Axes) -> None:
    draw_seed_band(ax, [0, 1, 2], [[1.0, 2.0, 3.0]], LOOKS["polite"])
    assert ax.lines[-1].get_ydata().tolist() == [1.0, 2.0, 3.0]
    FigureCanvasAgg(ax.figure).draw()


def test_band_stays_where_the_quantity_can_be(ax: Axes) -> None:
    draw_seed_band(ax, [0, 1], [[0.0, 0.9], [0.1, 1.0]], LOOKS["polite"], within=(0, 1))
    edges = np.concatenate([line.get_ydata() for line in ax.lines])
    assert edges.min() >= 0.0
    assert edges.max() <= 1.0


def test_every_seed_is_a_dot_and_missing_ones_are_none(ax: Axes) -> None:
    draw_seeds(ax, [("a", [1.0, None, 3.0], LOOKS["polite"]), ("b", [], LOOKS["baseline"])], "y")
    assert ax.lines[0].get_ydata().tolist() == [1.0, 3.0]
    assert [text.get_text() for text in ax.get_xticklabels()] == ["a", "b"]


def test_divergence_shows_both_nulls(ax: Axes, results: dict[str, Any]) -> None:
    draw_divergence(ax, results["kl"])
    legend = ax.get_legend()
    assert legend is not None
    labels = [text.get_text() for text in legend.get_texts()]
    assert sum(label.startswith("null") for label in labels) == 2


def test_timeline_places_windows_in_seconds(ax: Axes) -> None:
    draw_timeline(ax, 50, {"positive": (12, 22), "negative": (31, 49)}, 0.1)
    spans = [(p.get_x(), p.get_x() + p.get_width(), p.get_hatch()) for p in ax.patches[1:]]
    assert spans[0] == (pytest.approx(1.2), pytest.approx(2.3), "////")
    assert spans[1] == (pytest.approx(3.1), pytest.approx(5.0), "....")
    assert [text.get_text() for text in ax.texts] == ["+ good", "− bad"]


def test_strip_marks_the_frames_of_a_window() -> None:
    figure = Figure()
    frames = np.zeros((50, 20, 100, 3), dtype=np.uint8)
    draw_strip(
        figure.add_subfigure(figure.add_gridspec(1, 1)[0]), frames, {"positive": (18, 22)}, 0.1, "t"
    )
    panels = figure.subfigs[0].axes[:-1]
    marked = ["+ good" in [text.get_text() for text in panel.texts] for panel in panels]
    assert marked == [False, False, True, False, False, False]  # frames 0, 10, 20, 29, 39, 49


def test_windows_leave_out_what_was_not_marked() -> None:
    assert example_windows({"positive": [1, 4], "negative": None}) == {"positive": (1, 4)}


@pytest.mark.parametrize("seeds", [1, 3])
def test_every_figure_draws_without_a_warning(seeds: int) -> None:
    drawn = fake_results(seeds)
    makers = (
        figures.reward_map_figure,
        figures.around_objects_figure,
        figures.map_2d_figure,
        figures.goal_distance_figure,
        figures.divergence_figure,
        figures.policy_figure,
        figures.quality_figure,
        figures.sensitivity_figure,
    )
    with rc_context(STYLE):
        for make in makers:
            FigureCanvasAgg(make(drawn)).draw()
