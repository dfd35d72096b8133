"""A study's data as a folder, or as one zip file, for the learner and for everybody else."""

from __future__ import annotations

import io
import json
import zipfile
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

from polite.dataset import FILES, MANIFEST, Feedback, load_feedback, save_feedback
from polite.files import sha256, system_says, write_atomically, write_json
from polite.study.changes import check_unchanged
from polite.study.columns import (
    ANSWERS,
    DICTIONARY,
    PARTICIPANTS,
    AnswerRow,
    PersonRow,
    dictionary,
    questionnaire_columns,
)
from polite.study.design import CONDITIONS, FILE, Design, read_design
from polite.study.export_names import DATA, DESIGNS, PARTICIPANTS_TABLE, SUMMARY, VERSION
from polite.study.quality import COUNTED, REASONS, answered, exclusion
from polite.study.records import AnswerRecord, StudyRecords, TrialRecord, said
from polite.study.tables import as_csv, as_jsonl, dictionary_markdown
from polite.study.to_feedback import LearnerAnswers, highlight, learner_answers, segments_of
from polite.types import PoliteError, Query, SegmentPool

POOL: Final = "pool"
"""The study's segments and comparisons, in its folder."""


@dataclass(frozen=True, eq=False)
class _Source:
    """All that an export is made from."""

    design: Design
    pool: SegmentPool
    queries: list[Query]
    records: StudyRecords
    learner: dict[Any, LearnerAnswers]
    people: list[PersonRow]


def export(study: Path, records: StudyRecords, out: Path) -> Path:
    """Write everything that was answered in a study into a folder.

    Everything is worked out before anything is written; each file is written whole or not at all,
    and `export.json` last, so that an export that was interrupted has none.

    Args:
        study: The study's folder, for its design, segments and comparisons.
        records: Who answered what.
        out: The folder, made if needed; files of an earlier export are replaced.

    Returns:
        `out`.

    Raises:
        PoliteError: The study's folder is not whole, the records do not fit it, or the folder
            cannot be written into.
    """
    source = _read(study, records)
    texts = dict(_texts(source))
    summary = _summary(source)
    try:
        (out / SUMMARY).unlink(missing_ok=True)  # a half-written export must not look whole
        texts[FILE] = (study / FILE).read_text(encoding="utf-8")
    except OSError as error:
        raise PoliteError(f"{out}: cannot be written into ({system_says(error)})") from error
    for condition, learner in source.learner.items():
        save_feedback(
            out / DATA / condition, Feedback(source.pool, source.queries, learner.answers)
        )
    for name, text in texts.items():
        write_atomically(out / name, partial(_write, text=text))
    data = [f"{DATA}/{c}/{name}" for c in CONDITIONS for name in (*FILES, MANIFEST)]
    checksums = {name: sha256(out / name) for name in sorted([*texts, *data])}
    write_json(out / SUMMARY, summary | {"sha256": checksums})
    return out


def export_zip(study: Path, records: StudyRecords) -> bytes:
    """The same as one zip file; equal records give equal bytes.

    Raises:
        PoliteError: As `export`.
    """
    content = io.BytesIO()
    with TemporaryDirectory() as temporary:
        folder = export(study, records, Path(temporary))
        with zipfile.ZipFile(content, "w") as archive:
            for path in sorted(path for path in folder.rglob("*") if path.is_file()):
                entry = zipfile.ZipInfo(path.relative_to(folder).as_posix())  # dated 1980
                entry.external_attr = 0o644 << 16
                archive.writestr(entry, path.read_bytes(), zipfile.ZIP_DEFLATED)
    return content.getvalue()


def _write(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8", newline="")


def _read(study: Path, records: StudyRecords) -> _Source:
    design = read_design(study / FILE)
    check_unchanged(design, sha256(study / POOL / MANIFEST), records.shown)
    feedback = load_feedback(study / POOL)
    pool, queries = feedback.pool, feedback.queries
    learner = learner_answers(records, design, pool, queries)
    numbers = {n: i for c in learner.values() for i, n in enumerate(c.participants)}
    people = [
        PersonRow(person, design, exclusion(person, design), numbers.get(person.number))
        for person in sorted(records.participants, key=lambda person: person.number)
    ]
    return _Source(design, pool, queries, records, learner, people)


def _texts(source: _Source) -> Iterator[tuple[str, str]]:
    """All files but the learner's data and the summary, by name."""
    answers = [row for person in source.people for row in _answer_rows(source, person)]
    files = dictionary(source.design)
    described = [(name, column) for name, columns in files for column in columns]
    yield "answers.csv", as_csv(ANSWERS, answers)
    yield "answers.jsonl", as_jsonl(ANSWERS, answers)
    yield PARTICIPANTS_TABLE, as_csv(PARTICIPANTS, source.people)
    questions = questionnaire_columns(source.design)
    yield "questionnaire.csv", as_csv(questions, source.people)
    yield "data_dictionary.csv", as_csv(DICTIONARY, described)
    yield "data_dictionary.md", dictionary_markdown(files)
    yield DESIGNS, _designs(source.records)


def _designs(records: StudyRecords) -> str:
    """Consent, guide and all the rest as each participant saw it, by the design's checksum."""
    shown = sorted(records.shown.designs.items())
    content = {sha: design.model_dump(mode="json") for sha, design in shown}
    return json.dumps(content, indent=2, ensure_ascii=False) + "\n"


def _answer_rows(source: _Source, by: PersonRow) -> Iterator[AnswerRow]:
    """Every revision of every comparison of one participant, practice included, in order."""
    for trial, revisions in answered(by.person, ("practice", *COUNTED)):
        pair = segments_of(trial, source.design, source.queries)
        for answer in revisions:
            windows = _windows(source, trial, answer, pair)
            yield AnswerRow(by, trial, answer, answer is revisions[-1], pair, windows)


def _windows(
    source: _Source, trial: TrialRecord, answer: AnswerRecord, pair: tuple[int, int]
) -> tuple[tuple[int, int] | None, tuple[int, int] | None]:
    """First and last step of the good and of the bad window."""
    place = {"first": 0, "second": 1}.get(said(trial, answer.choice))
    if place is None:
        return None, None
    steps = int(source.pool.lengths[pair[place]])
    marks = (
        highlight(at, source.design.highlight_length, steps) for at in (answer.good, answer.bad)
    )
    good, bad = ((mark.start, mark.end) if mark else None for mark in marks)
    return good, bad


def _summary(source: _Source) -> dict[str, Any]:
    """`export.json` without the checksums."""
    design, people = source.design, source.people
    robots = design.by_robots or any(row.person.robot for row in people)
    return {
        "version": VERSION,
        "title": design.title,
        "env": design.env,
        "env_settings": design.env_settings,
        "highlight_length": design.highlight_length,
        "segment_length": int(source.pool.rewards.shape[1]),
        "comparisons": design.comparisons,
        "simulated": robots,
        "simulated_by": "robots" if robots else None,
        "design": design.sha,
        "designs": dict(sorted(Counter(row.person.design_sha for row in people).items())),
        "consent_versions": dict(sorted(Counter(r.person.consent_version for r in people).items())),
        "conditions": {
            condition: _counts([r for r in people if r.person.condition == condition])
            | {
                "withdrawn": source.records.withdrawn.get(condition, 0),
                "answers": len(source.learner[condition].answers),
            }
            for condition in CONDITIONS
        },
    }


def _counts(rows: Sequence[PersonRow]) -> dict[str, Any]:
    """How many joined, finished, are in the learner's data, and are not and why."""
    return {
        "joined": len(rows),
        "finished": sum(row.person.finished_at is not None for row in rows),
        "included": sum(not row.reasons for row in rows),
        "excluded": {reason: sum(reason in row.reasons for row in rows) for reason in REASONS},
    }
