"""What of a study must stay as it is once people have taken part. Pure."""

from __future__ import annotations

import json
from typing import Any, Final

from polite.files import one_line
from polite.study.design import FILE, Design
from polite.study.records import Shown
from polite.types import PoliteError

WORDS: Final = frozenset({"title", "contact", "consent", "guide", "completion", "recorded"})
"""What no stored answer refers to: words around the comparisons, and where clips came from. All the
rest is what was asked, or a rule that is fixed before the data are seen."""
_INSTEAD: Final = "restore it, or make another folder for another study"


class ChangedError(PoliteError):
    """A study that is not the one that people have taken part in."""


def check_unchanged(design: Design, pool: str, shown: Shown) -> None:
    """Check that the answers that are stored are still answers to this study.

    Args:
        design: The study as it is now.
        pool: Checksum of its segments and comparisons.
        shown: What its participants have seen.

    Raises:
        ChangedError: They are not, or a text of the consent has two meanings; says what changed.
    """
    for earlier in shown.designs.values():
        _check_fixed(_fixed(earlier), _fixed(design))
        if _said(earlier) != _said(design) and earlier.consent.version == design.consent.version:
            raise ChangedError(
                f"{FILE}: consent.text: people have agreed to another text of version "
                f"{earlier.consent.version!r}; give the new text a new version"
            )
    if shown.designs and shown.pools - {pool}:
        raise ChangedError(
            "pool: people have compared other segments or pairs than those that are there now; "
            + _INSTEAD
        )


def _said(design: Design) -> str:
    return design.consent.text.strip()


def _check_fixed(before: dict[str, Any], now: dict[str, Any]) -> None:
    for name in before:
        if before[name] != now[name]:
            seen = [one_line(ValueError(json.dumps(each[name]))) for each in (before, now)]
            raise ChangedError(
                f"{FILE}: {name}: expected {seen[0]}, as it was when people took part, got "
                f"{seen[1]}; {_INSTEAD}"
            )


def _fixed(design: Design) -> dict[str, Any]:
    """All but words, as JSON keeps it."""
    content: dict[str, Any] = json.loads(design.model_dump_json(exclude=set(WORDS)))
    for item in content["practice"]:
        del item["explanation"]
    return content
