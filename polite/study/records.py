"""A study's answers as plain records, whatever they are stored in.

Times are seconds since the epoch; the server's, unless a name says `client`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from polite.study.design import Condition, Design, Kind
from polite.types import PoliteError

Choice = Literal["left", "right", "equal", "incomparable"]
Said = Literal["first", "second", "equal", "incomparable"]
"""A choice in terms of the query's segments, wherever they stood."""


class RecordsError(PoliteError):
    """Records that do not belong to the study's design and pool."""


@dataclass(frozen=True)
class TrialRecord:
    """One comparison as one participant saw it."""

    place: int
    """Where it stands in the participant's sequence, from 0; practice comes first."""
    kind: Kind
    """repeated and mirrored are catch pairs: a main comparison again, with left and right as they
    were or exchanged."""
    query: int
    """Index in the pool's queries; of practice, nothing that counts."""
    first_is_left: bool
    """Whether the query's first segment was shown on the left."""


@dataclass(frozen=True)
class AnswerRecord:
    """One revision of one answer; a changed answer is a further one, nothing is overwritten."""

    place: int
    """Of the trial."""
    revision: int
    """1 for the first answer."""
    choice: Choice
    """What was chosen, as it was shown."""
    good: int | None
    """First step of the good window on the preferred clip."""
    bad: int | None
    """First step of the bad one."""
    nothing: bool
    """Whether the participant said that nothing stands out."""
    served_at: float
    """When the trial was first sent to the page."""
    watched_at: float | None
    """When the page said that both clips had been watched."""
    received_at: float
    """When this revision arrived."""
    client_shown_at: float | None
    """When the trial appeared, by the page's clock."""
    client_watched_at: float | None
    """When both clips had been watched, by the page's clock."""
    client_chosen_at: float | None
    """When the choice was made, by the page's clock."""
    client_answered_at: float | None
    """When the answer was sent, by the page's clock."""
    replays: int
    """How often the clips were played again."""


@dataclass(frozen=True)
class ParticipantRecord:
    """One participant, with everything they were shown and said; nothing tells who they are."""

    number: int
    condition: Condition
    block: int
    """Which of the study's blocks of comparisons."""
    consent_version: str
    """Of the text that was agreed to."""
    design_sha: str
    """SHA-256 of the design when they joined."""
    joined_at: float
    """When they gave their consent."""
    finished_at: float | None
    """When they came to the end, the questionnaire included."""
    stage: str
    """guide, practice, comparisons, questions or done."""
    trials: tuple[TrialRecord, ...]
    answers: tuple[AnswerRecord, ...]
    """All revisions, in any order."""
    questions: Mapping[str, str | float | None]
    """The questionnaire's answers by the question's name; empty if not given."""
    last_seen: float
    robot: bool = False
    """Whether the design that they joined said that robots answer."""

    def revisions(self) -> dict[int, list[AnswerRecord]]:
        """The revisions of each answered place, in order.

        Raises:
            RecordsError: If there is an answer to a place that has no trial.
        """
        places = {trial.place for trial in self.trials}
        found: dict[int, list[AnswerRecord]] = {}
        for answer in sorted(self.answers, key=lambda a: (a.place, a.revision)):
            if answer.place not in places:
                raise RecordsError(
                    f"participant {self.number}: expected answers to places of their trials, got "
                    f"one to place {answer.place}; restore the database from a copy"
                )
            found.setdefault(answer.place, []).append(answer)
        return found


@dataclass(frozen=True)
class Shown:
    """What of a study has been shown to its participants so far."""

    designs: Mapping[str, Design] = field(default_factory=dict)
    """By checksum; those that anybody who is still in the study has taken part in."""
    pools: frozenset[str] = frozenset()
    """Checksums of segments and comparisons."""


@dataclass(frozen=True)
class StudyRecords:
    """Everybody who took part and did not withdraw."""

    participants: tuple[ParticipantRecord, ...]
    withdrawn: Mapping[Condition, int] = field(default_factory=dict)
    """How many withdrew; their answers are gone."""
    shown: Shown = field(default_factory=Shown)


def said(trial: TrialRecord, choice: Choice) -> Said:
    """What a choice says of the query's first and second segment."""
    if choice in ("left", "right"):
        return "first" if (choice == "left") == trial.first_is_left else "second"
    return "equal" if choice == "equal" else "incomparable"
