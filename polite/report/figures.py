"""Every figure of a run, from its stored numbers to PDF and PNG files."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from polite.analysis.claims_reward import PERSON_NEAR
from polite.plots.divergence import draw_divergence, draw_divergence_forms
from polite.plots.goal_distance import draw_goal_distance
from polite.plots.map_2d import draw_map_2d, shared_limits
from polite.plots.policy import draw_final, draw_learning
from polite.plots.quality import draw_policy_difference, draw_quality, draw_sensitivity
from polite.plots.reward_map import REWARD, draw_offset, draw_reward_map
from polite.plots.scene import along_handles, floor_handles
from polite.plots.strip import draw_strip, example_windows
from polite.plots.style import GREY, LOOKS, WIDTH, panel_letters, shared_legend
from polite.report.clips import clip_paths, read_clip
from polite.report.stored import draw_all

Results = Mapping[str, Any]

OVER_STATES = "± 1 sd over states"
OVER_SEEDS = "95% t interval over seeds"


def draw_figures(results: Results, folder: Path) -> list[Path]:
    """Draw all figures of a run into `folder/figures`, each as a PDF and a PNG of 200 dpi.

    Args:
        results: The content of results.json.
        folder: The run's folder; its `clips/` feed the strip of frames.

    Returns:
        The PNG files, in the order of the report.
    """
    return draw_all(figures(results, folder), results, folder / "figures")


def figures(results: Results, folder: Path) -> dict[str, Callable[[Results], Figure]]:
    """The figures that these results allow, by file name."""
    chosen: dict[str, Callable[[Results], Figure]] = {
        "fig5a_reward_map": reward_map_figure,
        "fig5a_around_objects": around_objects_figure,
        "map_2d": map_2d_figure,
        "fig5b_goal_distance": goal_distance_figure,
        "fig5c_divergence": divergence_figure,
        "fig5d_policy": policy_figure,
        "reward_quality": quality_figure,
    }
    if results["sensitivity"]:
        chosen["sensitivity"] = sensitivity_figure
    if clip_paths(results["example"], folder):
        chosen["query_strip"] = lambda r: strip_figure(r, folder)
    return chosen


def reward_map_figure(results: Results) -> Figure:
    """Fig. 5a: reward along the corridor, raw above standardised."""
    figure = Figure(figsize=(WIDTH, 5.0))
    above, below = figure.subplots(2, 1, sharex=True)
    draw_reward_map(above, results["reward_map"], results["scene"])
    draw_reward_map(below, results["reward_map"], results["scene"], standardised=True)
    above.set_xlabel("")
    for text in below.texts:
        text.set_visible(False)  # the names above the upper panel serve both
    one_seed = Line2D([], [], color=GREY, lw=0.6, label="a single seed")
    shared_legend(figure, above, OVER_STATES, [one_seed, *along_handles()], columns=3)
    return figure


def around_objects_figure(results: Results) -> Figure:
    """Fig. 5a beside the objects: reward by signed distance to goals and nearest person."""
    figure, scene = Figure(figsize=(WIDTH, 2.75)), results["scene"]
    axes = list(figure.subplots(1, 3, sharey=True))
    kinds = (
        ("intermittent goal", "intermittent_offset", scene["intermittent_radius"], True),
        ("end goal", "goal_offset", scene["goal_radius"], True),
        ("nearest person", "person_offset", PERSON_NEAR, False),
    )
    for ax, (title, key, radius, goal) in zip(axes, kinds, strict=True):
        draw_offset(ax, results[key], radius, goal=goal, reach=4.0)
        ax.set_title(title)
    axes[0].set_ylabel(REWARD)
    panel_letters(axes)
    shared_legend(figure, axes[0], OVER_STATES)
    return figure


def map_2d_figure(results: Results) -> Figure:
    """Both rewards on the floor plan, raw and standardised, each pair on one colour scale."""
    figure, maps = Figure(figsize=(WIDTH, 6.6)), results["reward_map_2d"]
    axes = list(figure.subplots(4, 1, sharex=True))
    for first, standardised in ((0, False), (2, True)):
        limits = shared_limits(maps, standardised=standardised)
        for ax, name in zip(axes[first : first + 2], ("polite", "baseline"), strict=True):
            mesh = draw_map_2d(ax, maps[name], results["scene"], limits, standardised=standardised)
            ax.set_title(LOOKS[name].label + (", standardised" if standardised else ""))
        label = "standardised reward [sd]" if standardised else REWARD
        figure.colorbar(mesh, ax=axes[first : first + 2], label=label, extend="both", pad=0.015)
    axes[-1].set_xlabel("position along the corridor z [m]")
    panel_letters(axes)
    figure.legend(handles=floor_handles(), loc="outside lower center", ncols=3)
    return figure


def goal_distance_figure(results: Results) -> Figure:
    """Fig. 5b: mapped reward against the distance to the end goal and to the nearer goal."""
    figure, radius = Figure(figsize=(WIDTH, 2.9)), results["scene"]["goal_radius"]
    axes = list(figure.subplots(1, 2, sharey=True))
    draw_goal_distance(axes[0], results["goal_distance"], radius, "the end goal")
    draw_goal_distance(axes[1], results["nearest_goal_distance"], radius, "the nearer goal")
    axes[1].set_ylabel("")
    panel_letters(axes)
    shared_legend(figure, axes[0], OVER_STATES)
    return figure


def divergence_figure(results: Results) -> Figure:
    """Fig. 5c: divergence with its null curves, and by the two other forms."""
    figure = Figure(figsize=(WIDTH, 3.2))
    axes = list(figure.subplots(1, 2))
    draw_divergence(axes[0], results["kl"]).set_title("with null curves")
    draw_divergence_forms(axes[1], results["kl"]).set_title("other forms")
    panel_letters(axes)
    return figure


def policy_figure(results: Results) -> Figure:
    """Fig. 5d: learning curves over final values, by the true reward and its parts."""
    figure = Figure(figsize=(WIDTH, 4.9))
    top, bottom = figure.subplots(2, 3)
    names = {"return": "true return", "success_rate": "success rate"}
    names |= {"collision_rate": "collision rate"}
    for ax, (key, label) in zip(top, names.items(), strict=True):
        draw_learning(ax, results["curves"], key, label)
    finals = {"return": "true return"} | {
        f"{kind}_rate": f"{kind} rate" for kind in ("success", "collision")
    }
    for ax, (key, label) in zip(bottom, finals.items(), strict=True):
        draw_final(ax, results["policy"], key, f"final {label}")
    panel_letters([*top, *bottom])
    shared_legend(figure, top[0], OVER_SEEDS)
    return figure


def quality_figure(results: Results) -> Figure:
    """Agreement of the learned rewards with the true one, and how far the policies differ."""
    figure = Figure(figsize=(WIDTH, 2.6))
    axes: list[Axes] = list(figure.subplots(1, 3))
    draw_quality(axes[0], results["reward_quality"], "pair_accuracy", "pair accuracy")
    draw_quality(axes[1], results["reward_quality"], "correlation", "step-wise correlation")
    draw_policy_difference(axes[2], results["policy_difference"])
    panel_letters(axes)
    return figure


def sensitivity_figure(results: Results) -> Figure:
    """POLITE minus baseline under other settings of the simulated participants."""
    rows = results["sensitivity"]
    figure = Figure(figsize=(WIDTH, 1.1 + 0.26 * len(rows)))
    axes = list(figure.subplots(1, 2, sharey=True))
    draw_sensitivity(axes[0], rows, "pair_accuracy", "pair accuracy, POLITE minus baseline")
    draw_sensitivity(axes[1], rows, "correlation", "correlation, POLITE minus baseline")
    panel_letters(axes)
    return figure


def strip_figure(results: Results, folder: Path) -> Figure:
    """Both clips of the example query as strips of frames, side by side."""
    example = results["example"]
    clips = [read_clip(path, example["fps"]) for path in clip_paths(example, folder)]
    height, width = clips[0].shape[1:3]
    figure = Figure(figsize=(WIDTH, 1.1 + 6 * (WIDTH / 2 * height / width + 0.05)))
    grid = figure.add_gridspec(1, 2)
    halves = [figure.add_subfigure(grid[0, column]) for column in range(2)]
    for place, (half, clip) in enumerate(zip(halves, clips, strict=True)):
        chosen = place == example["preferred"]
        windows = example_windows(example) if chosen else {}
        title = ("first clip", "second clip")[place] + (" (preferred)" if chosen else "")
        draw_strip(half, clip, windows, 1 / example["fps"], title)
    return figure
