"""How a teacher who knows a reward marks highlights, whatever makes it prefer a clip."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import partial
from math import isnan
from typing import Self

from polite.teachers.highlights import CandidateRule, place_highlight, released_candidate
from polite.types import FIRST, SECOND, Answer, Floats64, InvalidValueError


@dataclass(frozen=True, kw_only=True)
class Marking:
    """Highlights at the extremes of the preferred segment.

    The defaults are those of the POLITE release on HalfCheetah.
    """

    positive_threshold: float = 0.3
    """h⁺ is given if its score is above this; infinity for none."""
    negative_threshold: float = -0.3
    """h⁻ is given if its score is below this; minus infinity for none."""
    length: int = 5
    """L, how many steps a highlight reaches back."""
    rule: CandidateRule = released_candidate
    """Which moment is marked, and its score."""
    marks_labelled: bool = True
    """Whether highlights come from the segment labelled the winner even by mistake (as in the
    release), or stay with the one that was chosen before the mistake (an ablation)."""
    sign_test: bool = True
    """Whether the reward over the highlight's own window must have its sign (POLITE)."""

    def __post_init__(self) -> None:
        """Check the settings.

        Raises:
            InvalidValueError: if a threshold is NaN or the length negative.
        """
        if self.length < 0 or isnan(self.positive_threshold) or isnan(self.negative_threshold):
            raise InvalidValueError(
                f"expected length ≥ 0 and thresholds that are numbers, got {self}"
            )

    def marking_like(self, other: Marking) -> Self:
        """The same teacher, who places highlights as another one does (that of a preset, say)."""
        same = {field.name: getattr(other, field.name) for field in fields(Marking)}
        return replace(self, **same)

    def express(
        self, query: int, rewards: tuple[Floats64, Floats64], chosen: int, mistaken: bool
    ) -> Answer:
        """An answer with a preference, and highlights on the winner.

        Args:
            query: index of the query.
            rewards: along the real steps of σ₁ and of σ₂, (t₁,) and (t₂,).
            chosen: the better one to the teacher, 0 or 1.
            mistaken: whether the other one is labelled the winner.
        """
        labelled = 1 - chosen if mistaken else chosen
        marked = labelled if self.marks_labelled else chosen
        place = partial(
            place_highlight,
            rewards[marked],
            length=self.length,
            rule=self.rule,
            sign_test=self.sign_test,
        )
        return Answer(
            query=query,
            preference=(FIRST, SECOND)[labelled],
            positive=place(+1, threshold=self.positive_threshold),
            negative=place(-1, threshold=self.negative_threshold),
            marks_other=marked != labelled,
        )
