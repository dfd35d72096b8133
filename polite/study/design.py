"""What a study with people consists of; the researcher fixes it in `study.toml`."""

from __future__ import annotations

import hashlib
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Final, Literal, Self

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    ValidationError,
    field_validator,
    model_validator,
)

from polite.files import one_line, system_says
from polite.study.export_names import QUESTIONNAIRE
from polite.types import PoliteError

FILE: Final = "study.toml"
"""The design's file in a study's folder."""

Condition = Literal["polite", "baseline"]
CONDITIONS: Final[tuple[Condition, ...]] = ("polite", "baseline")
"""Preferences with highlights, and preferences only; participants never see these names."""

Kind = Literal["practice", "main", "repeated", "mirrored"]
"""Of a comparison: repeated and mirrored ones are catch pairs."""

_PLACEHOLDER: Final = re.compile(r"\[[A-Z0-9][A-Z0-9 ,-]*\]")
"""As the template has them: [YOUR NAME, E-MAIL], [20]."""

_TAKEN: Final = (*QUESTIONNAIRE, "csrf", "main", "summary")
"""Columns of the export, the form's own field and ids of its page: no question may replace them."""


def _as_shown(text: str) -> str:
    """A text as browsers show it and send it back: single spaces, none at its ends."""
    return " ".join(text.split())


Text = Annotated[str, Field(min_length=1, max_length=20_000)]
Line = Annotated[str, Field(min_length=1, max_length=300)]
Option = Annotated[Line, AfterValidator(_as_shown)]
Index = Annotated[int, Field(ge=0)]


class DesignError(PoliteError):
    """A design that cannot be read or does not hold together."""


class _Part(BaseModel):
    """Frozen, and strict about names: a misspelt setting is an error."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)


class Consent(_Part):
    """What participants agree to."""

    version: Line
    """Change it whenever the text changes; every answer is exported with it."""
    text: Text
    """Paragraphs are separated by an empty line."""


class Example(_Part):
    """A clip of the guide, with a window that shows what to look for."""

    segment: Index
    """Its number in the pool."""
    start: Index
    """First step of the window; it has `highlight_length` + 1 steps."""
    text: Text
    """What happens there."""


class Guide(_Part):
    """What participants shall look for."""

    text: Text
    """Paragraphs are separated by an empty line."""
    good: Example
    """A good passage."""
    bad: Example
    """A bad passage."""


class Practice(_Part):
    """A comparison with feedback, before those that count."""

    first: Index
    """Segment of the pool."""
    second: Index
    """Segment of the pool."""
    expected: Literal["first", "second"]
    """Which of them most people prefer."""
    explanation: Text
    """Why; shown after the answer."""


class Question(_Part):
    """One question of the questionnaire at the end."""

    name: Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]{0,39}$")]
    """Its column in the export."""
    text: Line
    """What is asked."""
    kind: Literal["scale", "choice", "number", "text"]
    """scale: 1 to `points`; choice: one of `options`; number: 0 to 1,000,000; text: free."""
    required: bool = True
    """Whether an answer must be given."""
    points: Annotated[int, Field(ge=2, le=11)] = 7
    """Of a scale."""
    low: str = "not at all"
    """What a scale's first point means."""
    high: str = "very much"
    """What its last point means."""
    options: tuple[Option, ...] = ()
    """Of a choice."""

    @field_validator("name")
    @classmethod
    def _check_name(cls, name: str) -> str:
        if name in _TAKEN:
            taken = ", ".join(_TAKEN)
            raise ValueError(f"expected another name than {taken}, which export and page need")
        return name

    @model_validator(mode="after")
    def _check(self) -> Self:
        if (self.kind == "choice") != (len(self.options) >= 2):
            raise ValueError(f"{self.name}: a choice, and only a choice, has two or more options")
        if "" in self.options or len(set(self.options)) < len(self.options):
            raise ValueError(f"{self.name}: expected options that differ, and none that is empty")
        return self


class Completion(_Part):
    """What a participant gets at the end."""

    text: Text = "Thank you for taking part."
    """Shown at the end."""
    code: str = ""
    """The same for everybody, as panels ask for; empty: each participant gets one of their own."""
    url: Annotated[str, Field(pattern=r"^(https?://\S+)?$")] = ""
    """Where to go on to, such as a panel's page; empty: nowhere."""


class Exclusion(_Part):
    """Whose answers are left out of the learner's data; the export keeps them, with the reason."""

    failed_catch_pairs: Annotated[int, Field(ge=1)] = 2
    """From how many contradicted catch pairs on."""
    fast_share: Annotated[float, Field(gt=0, le=1)] = 0.5
    """From which share of too fast answers on."""
    fast_seconds: Annotated[float, Field(ge=0)] = 1.0
    """An answer is too fast if its choice follows so soon after both clips were watched [s].
    Marking does not count, so that the rule is the same in both conditions."""
    same_choice_share: Annotated[float, Field(gt=0.5, le=1)] = 1.0
    """Against those who click through: from which share of one and the same answer on, be it
    always left, always right, always "equal" or always "cannot compare". 1.0: only who never
    answers anything else. Catch pairs and practice do not count."""
    same_choice_answers: Annotated[int, Field(ge=2)] = 8
    """From how many answers on that is judged: who gives a few, may well mean them. By chance, 8
    preferences are all on one side for 1 person in 128."""


class Design(_Part):
    """A study: who compares what, and the words around it."""

    title: Line
    """Shown on every page."""
    contact: Line
    """Whom participants can ask."""
    answered_by: Literal["people", "robots"] = "people"
    """robots: programs answer, to try the study out; every export and report says so."""
    env: str
    """Id of the Gymnasium env that the pool's states come from."""
    env_settings: dict[str, Any] = {}
    """Its keywords, the size of the pictures among them."""
    recorded: str = ""
    """Folder with a clip for each segment, `<number>.mp4` or the like, for an env whose states
    cannot be drawn; relative to the study's folder. Empty: clips are drawn from states."""
    seed: Index = 0
    """Left and right, the order and the catch pairs follow from it and the participant's number."""
    participants: Annotated[int, Field(ge=1, le=100_000)] = 20
    """Wanted in each condition, and so the number of blocks of comparisons."""
    comparisons: Annotated[int, Field(ge=1, le=1000)] = 20
    """Each participant's, without practice and catch pairs."""
    repeated: Annotated[int, Field(ge=0, le=20)] = 1
    """Catch pairs: comparisons that come again as they were."""
    mirrored: Annotated[int, Field(ge=0, le=20)] = 1
    """Catch pairs: comparisons that come again with left and right exchanged."""
    highlight_length: Annotated[int, Field(ge=0, le=1000)] = 10
    """L: a highlight is a window of L + 1 steps (POLITE, Eq. 3)."""
    speeds: tuple[Annotated[float, Field(ge=0.1, le=4)], ...] = (0.5, 1.0, 2.0)
    """Speeds of the clips that participants can choose from."""
    consent: Consent
    """The first page."""
    guide: Guide
    """The second."""
    practice: Annotated[tuple[Practice, ...], Field(max_length=20)] = ()
    """Comparisons with feedback."""
    questions: Annotated[tuple[Question, ...], Field(max_length=50)] = ()
    """The questionnaire; without questions there is no such page."""
    completion: Completion = Completion()
    """The last page."""
    exclusion: Exclusion = Exclusion()
    """Rules that are fixed before the data are seen."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.repeated + self.mirrored > self.comparisons:
            raise ValueError("expected no more catch pairs than comparisons")
        if 1.0 not in self.speeds:
            raise ValueError(f"speeds: expected 1.0 among them, got {self.speeds}")
        names = [question.name for question in self.questions]
        if len(set(names)) < len(names):
            raise ValueError(f"questions: expected different names, got {names}")
        return self

    @property
    def by_robots(self) -> bool:
        """Whether programs answer, and no people."""
        return self.answered_by == "robots"

    @property
    def sha(self) -> str:
        """SHA-256 of all of it; what participants are exported with."""
        return hashlib.sha256(self.model_dump_json().encode()).hexdigest()

    @property
    def segments(self) -> set[int]:
        """The segments that guide and practice show."""
        pairs = {index for item in self.practice for index in (item.first, item.second)}
        return pairs | {self.guide.good.segment, self.guide.bad.segment}

    @property
    def placeholders(self) -> list[str]:
        """What the template left to the researcher and still stands in texts, each once."""
        found = (each for text in _texts(self.model_dump()) for each in _PLACEHOLDER.findall(text))
        return list(dict.fromkeys(found))


def read_design(path: Path) -> Design:
    """Read a design.

    Raises:
        DesignError: It is missing, no TOML, or does not hold together; the message says where.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise DesignError(f"{path}: cannot be read ({system_says(error)})") from error
    except ValueError as error:
        raise DesignError(f"{path}: expected text in UTF-8 ({one_line(error)})") from error
    return parse_design(text, str(path))


def parse_design(text: str, where: str = FILE) -> Design:
    """A design from its TOML.

    Args:
        text: The TOML.
        where: What an error calls it.

    Raises:
        DesignError: It is no TOML, or does not hold together; the message says where.
    """
    try:
        content = tomllib.loads(text)
    except ValueError as error:
        raise DesignError(f"{where}: expected TOML ({one_line(error)})") from error
    try:
        return Design(**content)
    except ValidationError as error:
        raise DesignError(f"{where}: {_first_mistake(error)}") from error


def _texts(value: object) -> Iterator[str]:
    """Every text within a design's part, in order."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, (dict, list, tuple)):
        for part in value.values() if isinstance(value, dict) else value:
            yield from _texts(part)


def _first_mistake(error: ValidationError) -> str:
    """Where the first mistake is, and how many more there are."""
    first, *more = error.errors()
    where = ".".join(map(str, first["loc"])) or "design"
    rest = f" (and {len(more)} more)" if more else ""
    return f"{where}: {first['msg']}, got {one_line(ValueError(repr(first['input'])))}{rest}"
