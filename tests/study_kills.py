"""A served study whose server is killed again and again while simulated participants answer."""

from __future__ import annotations

import asyncio
from collections import Counter, defaultdict
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from sqlalchemy import select
from study_process import ServedStudy, open_invitation
from study_robot import Confirmed, Robot, at_random

from polite.study import schema
from polite.study.database import Database
from polite.study.folder import StudyFolder

PARTICIPANTS = 40
LATEST = 0.03
"""The kill follows within this time after a confirmed answer [s], in the midst of others."""
DESIGN = {
    "participants = 2": "participants = 1\nspeeds = [1.0, 4.0]",
    "comparisons = 3": "comparisons = 6",
}
TRIALS = 1 + 6 + 2
"""Of each participant: practice, comparisons and catch pairs; all of them short."""


@dataclass(frozen=True)
class Killed:
    """What came of it."""

    kills: int
    confirmed: int
    """Answers that the server confirmed."""
    stored: int
    """Answers in the database."""
    lost: int
    """Confirmed ones that are not in the database as they were sent."""
    doubled: int
    """Rows that are there beyond the answers that were sent."""


def shorten(folder: StudyFolder) -> StudyFolder:
    """Give the test study many short trials."""
    path = folder.path / "study.toml"
    text = path.read_text(encoding="utf-8")
    for old, new in DESIGN.items():
        assert old in text
        text = text.replace(old, new)
    path.write_text(text, encoding="utf-8")
    return StudyFolder(folder.path)


async def answer_under_fire(
    served: ServedStudy, invitation: str, kills: int, rng: np.random.Generator
) -> list[Robot]:
    """Let all participants finish while the server is killed and started again.

    Each kill follows after a random number of confirmed answers, and a random while.

    Returns:
        The participants, each with the answers that were confirmed.
    """
    due = rng.integers(1, 2 * 10, kills).tolist()
    fire, left = asyncio.Event(), [due.pop()]

    def confirmed(answer: Confirmed) -> None:
        left[0] -= 1
        if left[0] == 0:
            fire.set()

    def robot() -> Robot:
        own = np.random.default_rng(rng.integers(2**63))
        decide, again = at_random(own), lambda: bool(own.random() < 0.2)
        return Robot(served.base, decide, again=again, confirmed=confirmed)

    async def kill() -> None:
        for _ in range(kills):
            await fire.wait()
            await asyncio.sleep(rng.uniform(0.0, LATEST))
            await asyncio.to_thread(served.kill)
            fire.clear()
            left[0] = due.pop() if due else 0
            served.start()

    robots = [robot() for _ in range(PARTICIPANTS)]
    async with asyncio.timeout(60 + 20 * kills), asyncio.TaskGroup() as group:
        group.create_task(kill())
        for each in robots:
            group.create_task(each.take_part(invitation))
    return robots


def kill_often(
    folder: StudyFolder, database_url: str, workers: int, kills: int, seed: int
) -> Killed:
    """Serve the study, kill it often, and compare what was confirmed with what is stored.

    Raises:
        AssertionError: What is stored is not whole.
    """
    folder = shorten(folder)
    invitation = open_invitation(database_url, 10_000)
    served = ServedStudy(folder.path, database_url, workers)
    served.start()
    try:
        rng = np.random.default_rng(seed)
        robots = asyncio.run(answer_under_fire(served, invitation, kills, rng))
    finally:
        served.kill()
    return check(database_url, robots, kills)


def check(database_url: str, robots: list[Robot], kills: int) -> Killed:
    """Compare the database with what the participants remember."""
    answers, people = schema.answers, schema.participants
    database = Database(database_url)
    with database.read() as connection:
        rows = connection.execute(select(answers)).all()
        finished = set(connection.scalars(select(people.c.number).where(people.c.stage == "done")))
        if connection.dialect.name == "sqlite":
            assert connection.exec_driver_sql("PRAGMA integrity_check").all() == [("ok",)]
    database.close()
    by_submission = defaultdict(list)
    for row in rows:
        by_submission[row.submission].append(row)
    sent = [answer for robot in robots for answer in robot.answers]
    lost = sum(
        len(found := by_submission[a.submission]) != 1 or _differs(found[0], a) for a in sent
    )
    trials = _whole_sequences(rows)
    assert set(trials) == finished  # whoever was stored without being told has answered nothing
    assert len(finished) == len(robots)
    assert all(list(range(TRIALS)) == sorted(own) for own in trials.values())
    return Killed(kills, len(sent), len(rows), lost, len(rows) - len(sent))


def _differs(row, answer: Confirmed) -> bool:
    """Whether another answer is stored than was sent."""
    sent = [answer.place, answer.revision]
    sent += [answer.body[name] for name in ("choice", "good", "bad", "nothing")]
    sent.append(answer.body["answered_at"] / 1000.0)
    return sent != [
        row.place, row.revision, row.choice, row.good, row.bad, row.nothing_marked,
        row.client_answered_at,
    ]  # fmt: skip


def _whole_sequences(rows) -> dict[int, Counter[int]]:
    """Participant -> place -> revisions, which have no gaps."""
    revisions = defaultdict(list)
    for row in rows:
        revisions[row.participant, row.place].append(row.revision)
    trials: dict[int, Counter[int]] = defaultdict(Counter)
    for (participant, place), found in revisions.items():
        assert sorted(found) == list(range(1, len(found) + 1))
        trials[participant][place] = len(found)
    return trials


def sqlite_file(folder: Path) -> str:
    """URL of the study's own database."""
    return f"sqlite:///{folder / 'study.db'}"
