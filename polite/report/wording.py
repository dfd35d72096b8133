"""What the page says about those who answered: simulated participants, people, or robots."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from polite.analysis.respondents import Respondents, respondents


@dataclass(frozen=True)
class Wording:
    """The words that depend on who answered."""

    title: str
    """Of the page."""
    banner: str
    """Said first, and strongly."""
    more: str
    """Follows it."""
    one: str
    """Called so in the example, "a participant"."""
    no_mark: str
    """Said of an example without highlights."""
    pairs: str
    """Ends the sentence that counts the answers."""
    clips: str
    """What the trained policy's clips are for."""
    statistics: str
    """Caption of the table of answers."""
    emergent: str
    """Caption of the claims that are judged."""
    inputs: str
    """Ends the rules: what an input is."""


_BRACKETS: Final = (
    "brackets hold 95% intervals (rates: Wilson's, which takes answers as independent)."
)
_PAIRS: Final = ", on pairs of clips that both conditions share"
_HELD_OUT: Final = "Policy that made the held-out clips"

WORDING: Final[Mapping[Respondents, Wording]] = {
    "simulated": Wording(
        title="POLITE user study, replicated",
        banner="The participants are simulated.",
        more=" No human answered a query in this run. Rates and times that the simulation was "
        "calibrated to are listed as inputs; only what emerges from them says something about "
        "the method. Answers and pairs are the same under every seed: intervals over seeds cover "
        "the chance of training, not that of who took part.",
        one="a simulated participant",
        no_mark="The participant marked no highlight.",
        pairs=", on the same pairs of clips",
        clips="Policy that made the clips",
        statistics="Answers of the participants. Rates and times are calibrated inputs; brackets "
        "hold 95% intervals (rates: Wilson's, which takes answers as independent).",
        emergent="Claims that emerge from the run.",
        inputs="Input: put in by calibration or design.",
    ),
    "people": Wording(
        title="POLITE user study, replicated with people",
        banner="People answered.",
        more=" The answers are from a study on the web page of this project; those of participants "
        "who did not finish, or who are excluded by the rules of its design, are left out. Rates, "
        "highlights and times are findings here. Rewards and policies were trained on the answers; "
        "intervals over seeds cover the chance of training, not that of who took part.",
        one="a participant",
        no_mark="The participant marked no highlight.",
        pairs=_PAIRS,
        clips=_HELD_OUT,
        statistics=f"Answers of the participants; {_BRACKETS}",
        emergent="Claims that this run can judge.",
        inputs="Input: set by the study's design.",
    ),
    "robots": Wording(
        title="POLITE user study, tried out with robots",
        banner="The participants are simulated: robots that answer as the oracle.",
        more=" Programs went through the web page of a study, to try it out; no human answered. "
        "Their rates, highlights and times come from their program and say nothing about people. "
        "Intervals over seeds cover the chance of training, not that of who took part.",
        one="a robot",
        no_mark="The robot marked no highlight.",
        pairs=_PAIRS,
        clips=_HELD_OUT,
        statistics=f"Answers of the robots; rates and times are their program's; {_BRACKETS}",
        emergent="Claims that emerge from the run.",
        inputs="Input: put in by the robots' program or by the study's design.",
    ),
}


def wording(results: Mapping[str, Any]) -> Wording:
    """The words for a run."""
    return WORDING[respondents(results)]
