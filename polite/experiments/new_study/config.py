"""The settings of `polite study new`; the command line is made from them. Imports nothing heavy."""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Annotated, Any

import tyro

from polite.types import InvalidValueError, PoliteError

_LEAST = {"segments": 4, "length": 1, "participants": 1, "comparisons": 2, "seed": 0}


@dataclass(frozen=True, kw_only=True)
class NewStudyConfig:
    """Make the folder of a study with people: clips, comparisons, texts.

    Without --pool and --env it is the demo, in which a robot drives past people in a corridor.
    """

    folder: Annotated[Path, tyro.conf.Positional]
    """Where the study shall be; new, unless --resume."""
    pool: Path | None = None
    """A feedback data set whose clips and pairs are shown, such as data/polite of a replication;
    pairs are drawn where it has none. Its answers stay where they are."""
    env: str | None = None
    """Id of the Gymnasium env that draws the pool's states, the corridor if not given. Without
    --pool the clips are collected in it."""
    policy: Path | None = None
    """A saved policy (.pt) that acts in --env; without it actions are drawn at random."""
    recorded: Path | None = None
    """A folder with a clip of each of the pool's segments, <number>.mp4, .webm or .gif, where the
    env cannot draw states; one frame a step."""
    config: Path | None = None
    """Your own study.toml, in place of one that is made for you to edit."""
    segments: int = 200
    """Clips to collect in --env."""
    length: int = 50
    """Steps of each of them."""
    participants: int | None = None
    """In each condition: 20, unless --config or the demo says otherwise."""
    comparisons: int | None = None
    """Of each participant: 20, unless --config or the demo says otherwise."""
    seed: int = 0
    """Everything random follows from it."""
    resume: bool = False
    """Go on in a folder that was begun, or make its clips anew after you edited study.toml."""

    def check(self) -> None:
        """Check that the settings go together.

        Raises:
            InvalidValueError: A number is too small.
            PoliteError: Two of them exclude each other, or one needs another.
        """
        for name, least in _LEAST.items():
            value = getattr(self, name)
            if value is not None and value < least:
                raise InvalidValueError(f"{name}: expected at least {least}, got {value}")
        if self.policy and (self.pool or not self.env):
            raise PoliteError("--policy acts in --env, and needs it; leave --pool out")
        if self.recorded and not self.pool:
            raise PoliteError("--recorded shows the segments of a pool; give --pool as well")
        if (self.config or self.is_demo) and (self.participants or self.comparisons):
            raise PoliteError(
                "--participants and --comparisons are study.toml's to say here; edit it, or give "
                "--pool or --env without --config"
            )

    @property
    def is_demo(self) -> bool:
        """Whether the clips are those that come with the package."""
        return self.pool is None and self.env is None

    def settings(self) -> dict[str, Any]:
        """Everything but the folder and whether to go on, as JSON keeps it; paths from the root."""
        content = {n: v for n, v in asdict(self).items() if n not in ("folder", "resume")}
        return {
            name: str(value.resolve()) if isinstance(value, Path) else value
            for name, value in content.items()
        }

    def begun_with(self, stored: dict[str, Any]) -> NewStudyConfig:
        """The settings that a folder was begun with, where these ask for nothing else.

        Raises:
            PoliteError: They do.
        """
        defaults = {field.name: field.default for field in fields(self)}
        for name, value in self.settings().items():
            if value not in (defaults[name], stored.get(name)):
                raise PoliteError(
                    f"{self.folder} was begun with {name} = {stored.get(name)}, not {value}; "
                    "leave it out, or make another folder"
                )
        paths = {
            name: Path(stored[name])
            for name in ("pool", "policy", "recorded", "config")
            if stored.get(name)
        }
        try:
            return NewStudyConfig(folder=self.folder, resume=True, **{**stored, **paths})
        except TypeError as error:
            raise PoliteError(f"{self.folder} holds no study to go on with") from error
