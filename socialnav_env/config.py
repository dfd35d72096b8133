"""Every length, speed and weight of the corridor, with its unit and its source."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np


class ConfigError(ValueError):
    """A keyword of the corridor that does not exist or a value that cannot be."""


OUTER_WALL = 1.0
"""Thickness of the walls around the corridor [m]."""
TIME_LIMIT = 600
"""Steps after which `gym.make` and `gym.make_vec` truncate an episode unless told otherwise."""
DOORWAY_WALL = 0.2
"""Thickness of the wall around a doorway [m]."""

SCENARIOS: dict[str, dict[str, Any]] = {
    "paper": {},
    "empty": {"num_humans": 0},
    "crowded": {"num_humans": 10, "walking": "mixed"},
    "doorway": {"num_humans": 4, "walking": "along", "doorway_width": 1.8},
}
"""Named starting points for the keywords: `gym.make("SocialCorridor-v0", scenario="crowded")`."""


def _number(default: float, low: float, high: float, *, varies: bool = False) -> Any:
    """A field that holds a finite number in [low, high]; `varies`: reset's options may set it."""
    return field(default=default, metadata={"low": low, "high": high, "varies": varies})


def _count(default: int, low: int, high: int) -> Any:
    """A field that holds a whole number in [low, high]."""
    return field(
        default=default, metadata={"low": low, "high": high, "whole": True, "varies": False}
    )


def _choice(default: str, *others: str, varies: bool = False) -> Any:
    """A field that holds one of some words."""
    return field(default=default, metadata={"choices": (default, *others), "varies": varies})


def _switch(default: bool, *, varies: bool = False) -> Any:
    """A field that is True or False."""
    return field(default=default, metadata={"varies": varies})


@dataclass(frozen=True, kw_only=True)
class CorridorConfig:
    """The corridor, its robot, its people, its task and its reward.

    Each field is a keyword of ``gym.make("SocialCorridor-v0", ...)``. Lengths are metres, times
    seconds, angles radians. The axis ``z`` runs along the corridor and ``x`` across it, positive
    to the left of a robot that looks along ``+z``.

    Raises:
        ConfigError: A value is of another kind, out of its range, or at odds with another one.
    """

    # --- the scene (POLITE, section V-B and Fig. 5a) ---------------------------------------------
    half_length: float = _number(15.0, 5.0, 100.0)
    """Half of the corridor's length [m]; the final wall stands at z = half_length."""
    half_width: float = _number(3.0, 1.5, 20.0)
    """Half of the corridor's width [m]."""
    start_z: float = _number(-14.0, -100.0, 100.0, varies=True)
    """Where the robot starts along the corridor [m], give or take half a metre."""
    intermittent_z: float = _number(-2.5, -100.0, 100.0, varies=True)
    """The anchor of the intermittent goal [m]."""
    goal_z: float = _number(12.0, -100.0, 100.0, varies=True)
    """The anchor of the end goal [m]."""
    intermittent_radius: float = _number(0.8, 0.1, 5.0)
    """The intermittent goal is collected when the robot's centre is this close [m], by the way
    through the doorway where its wall lies between."""
    goal_radius: float = _number(1.0, 0.1, 5.0)
    """The end goal is reached when the robot's centre is this close [m], by the same way."""
    anchor_jitter: float = _number(2.0, 0.0, 10.0, varies=True)
    """Goals, and the places around which the first three people walk, are drawn within this
    distance of their anchors on each axis [m]; further people walk anywhere."""
    num_humans: int = _count(3, 0, 12)
    """How many people there are; the first three of those who walk start around the paper's anchors
    z = -10, 5 and 8, the others anywhere."""
    doorway_width: float = _number(0.0, 0.0, 40.0)
    """Width of an opening in a wall across the corridor [m]; 0 is no such wall."""
    doorway_z: float = _number(2.0, -100.0, 100.0)
    """Where that wall stands [m]."""

    # --- time ------------------------------------------------------------------------------------
    timestep: float = _number(0.05, 0.001, 0.5)
    """One physics step [s]."""
    frame_skip: int = _count(2, 1, 100)
    """Physics steps for each env step, so that dt = timestep * frame_skip."""

    # --- the robot (Pepper, maker's data sheet) --------------------------------------------------
    robot_radius: float = _number(0.3, 0.05, 1.0)
    """Radius of the robot's disc [m]."""
    robot_mass: float = _number(28.0, 1.0, 500.0)
    """Mass of the robot [kg]."""
    robot_speed: float = _number(0.83, 0.05, 5.0)
    """Top speed [m/s]; a unicycle's action 0 maps [-1, 1] to [0, robot_speed]."""
    robot_turn_rate: float = _number(1.0, 0.05, 10.0)
    """Top turn rate [rad/s]; the last action maps [-1, 1] to plus and minus this."""
    action: str = _choice("unicycle", "holonomic")
    """Unicycle: forward speed, turn rate. Holonomic: speed ahead, speed to the left, turn rate."""

    # --- what the robot observes -----------------------------------------------------------------
    observation: str = _choice("both", "state", "rays")
    """Beside its own pose and the goals: the people's states, nine range rays, or both."""
    ray_range: float = _number(6.0, 0.5, 100.0)
    """How far the nine range rays see [m]."""
    ray_noise: float = _number(0.0, 0.0, 5.0)
    """Standard deviation of the ranges [m]."""
    tracking_noise: float = _number(0.0, 0.0, 5.0)
    """Standard deviation of people's observed positions [m] and velocities [m/s]."""

    # --- people (social force; Helbing and Molnar 1995) ------------------------------------------
    walking: str = _choice("cross", "along", "mixed", "group", "queue", varies=True)
    """Cross the corridor, walk along it, some of each, stand in conversation, or queue."""
    reactive: bool = _switch(True, varies=True)
    """People evade each other and the robot; oblivious ones mind nothing but walls."""
    robot_visible: bool = _switch(True, varies=True)
    """People see the robot; where they do not, they still evade each other."""
    human_radius: float = _number(0.3, 0.05, 1.0)
    """Radius of a person's disc [m]."""
    human_mass: float = _number(70.0, 1.0, 500.0)
    """Mass of a person [kg]."""
    human_speed: float = _number(1.0, 0.05, 5.0, varies=True)
    """Mean of the people's preferred walking speed [m/s]."""
    human_speed_std: float = _number(0.15, 0.0, 1.0, varies=True)
    """Standard deviation of the preferred speed [m/s], cut at two of them."""
    human_roam: float = _number(1.5, 0.0, 30.0, varies=True)
    """How far along z waypoints of who crosses lie from the anchor drawn for the episode [m]."""
    human_patience: float = _number(8.0, 0.5, 600.0, varies=True)
    """A person who has been held up for this long turns to the next waypoint, and a queue moves up
    this often [s]."""
    relaxation_time: float = _number(0.5, 0.05, 5.0, varies=True)
    """tau: the time in which a person takes up the wanted velocity [s]."""
    human_force: float = _number(2.1, 0.0, 50.0, varies=True)
    """V0: strength of the repulsion between people [m^2/s^2]."""
    human_force_range: float = _number(0.3, 0.01, 5.0, varies=True)
    """sigma: range of the repulsion between people [m]."""
    human_foresight: float = _number(0.5, 0.0, 5.0, varies=True)
    """Delta t: how far ahead a person foresees another one's way [s]."""
    wall_force: float = _number(10.0, 0.0, 100.0, varies=True)
    """U0: strength of the repulsion from walls [m^2/s^2]."""
    wall_force_range: float = _number(0.2, 0.01, 5.0, varies=True)
    """R: range of the repulsion from walls [m]."""
    field_of_view: float = _number(math.radians(200.0), 0.0, 2.0 * math.pi, varies=True)
    """Whoever is outside this angle counts half in the repulsion [rad]."""

    # --- the true reward -------------------------------------------------------------------------
    goal_reward: float = _number(1.0, 0.0, 1000.0)
    """Paid once, on the step that reaches the end goal."""
    intermittent_reward: float = _number(0.5, 0.0, 1000.0)
    """Paid once, on the step that collects the intermittent goal."""
    collision_penalty: float = _number(1.0, 0.0, 1000.0)
    """Taken when robot and person, or robot and wall, touch after `contact_memory` without a
    contact of that kind, whoever ran into whom."""
    contact_penalty: float = _number(0.02, 0.0, 1000.0)
    """Taken on each further step in contact."""
    contact_memory: float = _number(0.5, 0.0, 60.0)
    """A contact with a person this soon after one with the same or another person is no new
    collision, nor is one with a wall this soon after one with a wall [s]; at 0 each step is one."""
    proximity_penalty: float = _number(0.02, 0.0, 1000.0)
    """Taken per step and person at touching distance; falls linearly to 0 at `personal_space`."""
    personal_space: float = _number(1.2, 0.0, 10.0)
    """Personal space, surface to surface [m] (Hall 1966)."""
    progress_weight: float = _number(0.2, 0.0, 100.0)
    """Reward per metre of progress on the way to the next goal (Ng et al. 1999); 0 is sparse."""
    control_penalty: float = _number(0.001, 0.0, 100.0)
    """Taken per step times the sum of the squared shares of top speed and top turn rate."""

    # --- the episode -----------------------------------------------------------------------------
    terminate_on_goal: bool = _switch(True)
    """End the episode when the end goal is reached."""
    terminate_on_collision: bool = _switch(True)
    """End the episode at a collision: when robot and person, or robot and wall, touch."""

    def __post_init__(self) -> None:
        """Check every field's kind and range, then the fields against each other."""
        for item in dataclasses.fields(self):
            value = _plain(getattr(self, item.name))
            _check(item.name, value, item.metadata)
            object.__setattr__(self, item.name, value)
        for name in ("start_z", "intermittent_z", "goal_z"):
            self._check_inside(name, self.robot_radius)
        if self.doorway_width > 0.0:
            self._check_doorway()
        self._check_timestep()
        self._check_dt()

    def _check_inside(self, name: str, margin: float) -> None:
        """Raise ConfigError unless that z keeps clear of the end walls."""
        limit = self.half_length - margin
        if abs(getattr(self, name)) > limit:
            raise ConfigError(
                f"{name}={getattr(self, name)} lies outside the corridor: expected a value in "
                f"[{-limit:g}, {limit:g}] (half_length={self.half_length:g})"
            )

    def _check_doorway(self) -> None:
        """Raise ConfigError unless robot and people pass through the opening in the wall."""
        widest = 2.0 * max(self.robot_radius, self.human_radius)
        # People keep away from both jambs at once: where less is free they do not dare to pass.
        self._check_inside("doorway_z", max(widest + 0.6, 2.0))  # one can stand on both sides
        narrow = widest + 0.6
        wide = 2.0 * self.half_width
        if not narrow <= self.doorway_width <= wide:
            raise ConfigError(
                f"doorway_width={self.doorway_width}: expected 0 (no wall) or a value in "
                f"[{narrow:g}, {wide:g}], so that everybody passes"
            )

    def _check_timestep(self) -> None:
        """Raise ConfigError if a physics step could take a centre into a wall or past another one.

        Nobody moves by more than its own radius. Two who come towards each other then stay apart
        as well: (a + b) / (v + w) lies between a / v and b / w.
        """
        longest = self.robot_radius / self.robot_speed
        if self.num_humans > 0:
            longest = min(longest, self.human_radius / self.human_top_speed)
        if self.timestep > longest:
            raise ConfigError(
                f"timestep={self.timestep}: at these speeds and radii somebody could get into a "
                f"wall or through a person in one step; expected at most {longest:.3g} s"
            )

    def _check_dt(self) -> None:
        """Raise ConfigError if an env step is too long for the social force or for pictures."""
        longest = self.relaxation_time if self.num_humans > 0 else 1.0
        if self.dt > longest:
            raise ConfigError(
                f"timestep * frame_skip = {self.dt:g} s: expected at most {longest:g} s"
                + (" (relaxation_time), or people would sway" if self.num_humans > 0 else "")
            )

    @property
    def dt(self) -> float:
        """One env step [s]."""
        return self.timestep * self.frame_skip

    @property
    def frames_per_second(self) -> int:
        """Pictures a second that come closest to real time; at least 1."""
        return max(1, round(1.0 / self.dt))

    @property
    def jamb(self) -> float:
        """|x| of the middle of the rounded ends of the wall around a doorway [m]; 0 without one."""
        if self.doorway_width == 0.0:
            return 0.0
        return 0.5 * (self.doorway_width + DOORWAY_WALL)

    @property
    def human_top_speed(self) -> float:
        """Nobody walks faster than this [m/s]: 1.3 times the fastest preferred speed."""
        return 1.3 * (self.human_speed + 2.0 * self.human_speed_std)

    @classmethod
    def from_keywords(cls, scenario: str = "paper", **keywords: Any) -> CorridorConfig:
        """Make a config from a named scenario and keywords, which win over the scenario's.

        Raises:
            ConfigError: A keyword or the scenario is unknown; the message lists the valid ones.
        """
        if not isinstance(scenario, str) or scenario not in SCENARIOS:
            raise ConfigError(f"scenario={scenario!r}: expected one of {', '.join(SCENARIOS)}")
        valid = [item.name for item in dataclasses.fields(cls)]
        unknown = sorted(set(keywords) - set(valid))
        if unknown:
            raise ConfigError(
                f"unknown keyword {', '.join(unknown)}; "
                f"valid are render_mode, render_width, camera, overlays, scenario, "
                f"{', '.join(valid)}"
            )
        return cls(**{**SCENARIOS[scenario], **keywords})


def _plain(value: Any) -> Any:
    """The value as Python's own, where it is a number or a switch of NumPy's."""
    return value.item() if isinstance(value, np.generic) else value


def _check(name: str, value: Any, metadata: Any) -> None:
    """Raise ConfigError unless the value is of its field's kind and in its range."""
    if "choices" in metadata:
        if not isinstance(value, str) or value not in metadata["choices"]:
            choices = ", ".join(metadata["choices"])
            raise ConfigError(f"{name}={value!r}: expected one of {choices}")
    elif "low" in metadata:
        _check_number(name, value, metadata)
    elif not isinstance(value, bool):
        raise ConfigError(f"{name}={value!r}: expected True or False")


def _check_number(name: str, value: Any, metadata: Any) -> None:
    """Raise ConfigError unless the value is a number in its range."""
    kind = "a whole number" if metadata.get("whole") else "a number"
    number = isinstance(value, int if metadata.get("whole") else (int, float))
    low, high = metadata["low"], metadata["high"]
    if isinstance(value, bool) or not number or not low <= value <= high:
        raise ConfigError(f"{name}={value!r}: expected {kind} in [{low:g}, {high:g}]")
