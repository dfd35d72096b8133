"""What an env's pictures look like: checked keywords, the robots' trails, the numbers laid over."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from socialnav_env.checks import is_whole
from socialnav_env.config import ConfigError, CorridorConfig
from socialnav_env.observation import (
    RAY_COS,
    RAY_SIN,
    ObservationParameters,
    observation_parameters,
    ray_length,
)
from socialnav_env.rendering import (
    DEFAULT_OVERLAYS,
    Annotations,
    Scene,
    check_look,
    draw_scene,
)
from socialnav_env.reward import TERMS
from socialnav_env.world import World

RENDER_MODES = ("human", "rgb_array")

Trail = tuple[tuple[float, float], ...]
"""A robot's way so far: x and z [m] of each moment."""


def scene_from_row(row: ArrayLike, trail: ArrayLike = ()) -> Scene:
    """A picture's content from a row of `State.scene_rows`.

    Args:
        row: (9 + 5 H,).
        trail: (K, 2) the robot's way so far, x and z [m].
    """
    values = np.asarray(row, dtype=np.float64)
    return Scene(
        robot=values[:3],
        collected=bool(values[3]),
        reached=bool(values[4]),
        goals=values[5:9].reshape(2, 2),
        people=values[9:].reshape(-1, 5),
        trail=np.asarray(trail, dtype=np.float64).reshape(-1, 2),
    )


def annotations_of(world: World, n: int) -> Annotations:
    """The numbers that overlays show of corridor `n`; the ranges are those without noise."""
    bodies = world.state.bodies[n]
    cos, sin = math.cos(bodies[0, 2]), math.sin(bodies[0, 2])
    sight = ObservationParameters(*map(float, observation_parameters(world.config)))
    rays = [
        ray_length(bodies, cos * c - sin * s, sin * c + cos * s, sight)
        for c, s in zip(RAY_COS.tolist(), RAY_SIN.tolist(), strict=True)
    ]
    return Annotations(
        rays=np.array(rays),
        forces=world.forces[n, :, ::-1],
        terms=dict(zip(TERMS, world.terms[n].tolist(), strict=True)),
    )


class Pictures:
    """How an env draws its corridors.

    Attributes:
        width: Width of a picture [px].
        corridors: Which corridors are drawn; only of these a trail is kept.
    """

    def __init__(
        self,
        config: CorridorConfig,
        corridors: Sequence[int],
        *,
        render_mode: str | None = None,
        render_width: int = 960,
        camera: str = "corridor",
        overlays: Collection[str] = DEFAULT_OVERLAYS,
    ) -> None:
        """Check the keywords.

        Raises:
            ConfigError: One of them is unknown or impossible.
        """
        if render_mode is not None and render_mode not in RENDER_MODES:
            raise ConfigError(
                f"render_mode={render_mode!r}: expected None or one of {RENDER_MODES}"
            )
        if not (is_whole(render_width) and 64 <= render_width <= 4096):
            raise ConfigError(
                f"render_width={render_width!r}: expected a whole number in [64, 4096]"
            )
        check_look(camera, overlays)
        self.width = int(render_width)
        self.corridors = tuple(corridors)
        self._config = config
        self._camera = camera
        self._overlays = tuple(overlays)
        wanted = self.corridors if render_mode is not None else ()
        self._trails: dict[int, list[tuple[float, float]]] = {n: [] for n in wanted}

    def frames(self, world: World) -> tuple[NDArray[np.uint8], ...]:
        """An (h, w, 3) picture of the present moment for each corridor that is drawn."""
        rows = world.state.scene_rows()
        return tuple(
            self._draw(scene_from_row(rows[n], self._trails.get(n, ())), annotations_of(world, n))
            for n in self.corridors
        )

    def draw_row(self, row: ArrayLike, trail: ArrayLike = ()) -> NDArray[np.uint8]:
        """(h, w, 3) a recorded moment; see `scene_from_row`."""
        return self._draw(scene_from_row(row, trail), None)

    def _draw(self, scene: Scene, annotations: Annotations | None) -> NDArray[np.uint8]:
        """(h, w, 3) a scene as the keywords want it."""
        return draw_scene(
            scene,
            self._config,
            self.width,
            camera=self._camera,
            overlays=self._overlays,
            annotations=annotations,
        )

    # --- trails ----------------------------------------------------------------------------------

    def follow(self, world: World) -> None:
        """Remember where the robots are."""
        for n, trail in self._trails.items():
            trail.append(_place(world, n))

    def forget(self, chosen: Iterable[int]) -> None:
        """Drop the trails of corridors in which an episode begins."""
        for n in chosen:
            if n in self._trails:
                self._trails[n].clear()

    def trails(self) -> dict[int, Trail]:
        """A copy of the trails, for a snapshot."""
        return {n: tuple(trail) for n, trail in self._trails.items()}

    def resume(self, trails: Mapping[int, Trail], world: World) -> None:
        """Go on from the trails of a snapshot, or from here where it has none."""
        for n, trail in self._trails.items():
            trail[:] = trails.get(n) or (_place(world, n),)


def _place(world: World, n: int) -> tuple[float, float]:
    """Where a robot is: x and z [m]."""
    z, x = world.state.bodies[n, 0, :2].tolist()
    return x, z
