"""A rule by which a claim about a grid is judged, and the words that several rules share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from polite.analysis.benchmark_records import HIGHLIGHTED, PAIRWISE, PAPER_FORM, Condition
from polite.analysis.comparisons import View, Wanted
from polite.analysis.verdicts import Kind, Part, above

NEAR = 0.9
"""Share of another mean from which on a return is "near" it, or no worse (our threshold)."""
POLITE_200 = Wanted("polite", 200)
BASELINE_400, BASELINE_800 = Wanted("preferences", 400), Wanted("preferences", 800)
HIGHLIGHTS_400 = Wanted("highlights", 400)
ABOVE_0: Final = "Welch's 95% t interval over runs lies above 0."


@dataclass(frozen=True)
class Rule:
    """A claim before it meets any record."""

    id: str
    text: str
    published: str
    rule: str
    wanted: tuple[Wanted, ...]
    """The cells that it reads."""
    judge: Callable[[View], tuple[Part, ...]]
    env: str = ""
    """What the env's name begins with; empty for a claim about any env."""
    kind: Kind = "emergent"
    """Under the paper's own conditions."""
    own: bool = False
    """Whether it is about our form, under the pairwise loss and the variants below, alone."""
    variants: tuple[str, ...] = ("",)
    """Of a rule of our own: under which variants of the training it is judged."""
    first_seed: int = 0
    """Runs of lower seeds are left out: for seeds that were added after others had been read."""

    def applies(self, env: str, condition: Condition) -> bool:
        """Whether the claim is about this env under this condition."""
        ours = condition.highlights not in (PAPER_FORM, None) and condition.loss == PAIRWISE
        meant = not self.own or (ours and condition.variant in self.variants)
        return env.startswith(self.env) and meant

    @property
    def highlighted(self) -> bool:
        """Whether any cell that it reads depends on the form of the highlights."""
        return any(which.method in HIGHLIGHTED for which in self.wanted)


def is_above(what: str, first: Wanted, second: Wanted) -> Callable[[View], tuple[Part, ...]]:
    """Judges whether the first cell's mean final true return is above the second's."""
    return lambda view: (above(what, view.difference(first, second), 0),)
