"""What participants are shown: the design, its pairs, and their clips."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from polite.study.assignment import Trial
from polite.study.clips import Clip
from polite.study.design import Design
from polite.types import Query


@dataclass(frozen=True, eq=False)
class Material:
    """Everything of a study that does not change while people answer."""

    design: Design
    queries: Sequence[Query]
    """The comparisons; each block is `design.comparisons` of them."""
    clips: Mapping[int, Clip]
    """A clip for each segment that is shown."""

    @property
    def trials(self) -> int:
        """How many trials each participant has."""
        design = self.design
        return self.practice + design.comparisons + design.repeated + design.mirrored

    @property
    def practice(self) -> int:
        """How many of them, at the beginning, are practice."""
        return len(self.design.practice)

    def sides(self, trial: Trial) -> tuple[Clip, Clip]:
        """The clips on the left and on the right."""
        pairs = self.design.practice if trial.kind == "practice" else self.queries
        pair = pairs[trial.query]
        first, second = self.clips[pair.first], self.clips[pair.second]
        return (first, second) if trial.first_is_left else (second, first)

    def shortest_watch(self, trial: Trial) -> float:
        """The least time in which both clips can be watched, side by side [s]."""
        seconds = max(clip.steps / clip.fps for clip in self.sides(trial))
        return seconds / max(self.design.speeds)
