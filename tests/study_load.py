"""How long an answer takes while many simulated participants answer at once.

The measured numbers are the participants': from before the request is sent until the reply is
read. They run in a process of their own, on the same machine as the server.
"""

from __future__ import annotations

import asyncio
import json
import os
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode
from study_process import ServedStudy, open_invitation
from study_robot import Exchange, Robot, at_random

from polite.dataset import Feedback, save_feedback
from polite.rollouts import collect
from polite.samplers import uniform_pairs
from polite.segments import cut_segments
from polite.study.clips import prepare_clips
from polite.study.folder import StudyFolder

LEVELS = (10, 50, 100, 200, 400)
"""Participants at once."""
THINK = (2.0, 4.0)
"""From a comparison's appearance to its answer [s], uniform: 3 s in the mean."""
RAMP = 40.0
"""Participants who join per second."""
SETTLE, WINDOW = 4.0, 30.0
"""After all have answered something, then measured [s]."""
PATIENCE = 60.0
"""Until all have [s]."""
ENV, SEGMENTS, STEPS, COMPARISONS = "socialnav_env:SocialCorridor-v0", 24, 50, 60
DESIGN = f"""
title = "Simulated load"
contact = "study@example.org"
answered_by = "robots"
env = "{ENV}"
participants = 4
comparisons = {COMPARISONS}
speeds = [1.0, 2.0, 4.0]
consent = {{ version = "1", text = "Simulated." }}

[guide]
text = "Simulated."
good = {{ segment = 0, start = 2, text = "Good." }}
bad = {{ segment = 1, start = 5, text = "Bad." }}

[[practice]]
first = 0
second = 1
expected = "first"
explanation = "Simulated."
"""


def make_study(path: Path) -> StudyFolder:
    """Clips of 50 steps, which take 1.25 s at the highest speed, and many comparisons."""
    rng = np.random.default_rng(0)
    env = gym.make_vec(ENV, 4, max_episode_steps=200, autoreset_mode=AutoresetMode.SAME_STEP)
    trajectories = collect(
        env, lambda seen: rng.uniform(-1, 1, (len(seen), 2)).astype(np.float32), 400, 0
    )
    env.close()
    pool = cut_segments(trajectories, STEPS, SEGMENTS, rng)
    save_feedback(path / "pool", Feedback(pool, uniform_pairs(4 * COMPARISONS, rng, pool)))
    (path / "study.toml").write_text(DESIGN, encoding="utf-8")
    folder = StudyFolder(path)
    prepare_clips(path, folder.design, folder.feedback)
    folder.check()
    return folder


def measure(
    folder: StudyFolder, database_url: str, workers: int, levels: tuple[int, ...] = LEVELS
) -> list[dict[str, Any]]:
    """Serve the study once and let more and more participants answer.

    Returns:
        A row for each number of participants, as `summary` makes it.
    """
    invitation = open_invitation(database_url, 10_000)
    served = ServedStudy(folder.path, database_url, workers)
    served.start()
    try:
        served.wait_until_up()
        return [_one_level(served, invitation, level) for level in levels]
    finally:
        served.kill()


def _one_level(served: ServedStudy, invitation: str, participants: int) -> dict[str, Any]:
    before, began = _processor_seconds(served.pid), time.monotonic()
    done = subprocess.run(
        [sys.executable, __file__, served.base, invitation, str(participants), str(WINDOW)],
        stdout=subprocess.PIPE,
        check=True,
        env=os.environ | {"PYTHONPATH": str(Path(__file__).parent)},
    )
    busy = _processor_seconds(served.pid) - before
    row: dict[str, Any] = json.loads(done.stdout)
    row["server_cores"] = round(busy / (time.monotonic() - began), 2)
    row["server_ms_per_request"] = round(1000.0 * busy / row["all_requests"], 2)
    row["server_megabytes"] = round(sum(map(_megabytes, _group(served.pid))), 1)
    print(row, flush=True)
    return row


async def put_under_load(
    base: str, invitation: str, participants: int, window: float
) -> dict[str, Any]:
    """Let participants join one after the other, then measure while all of them answer."""
    exchanges: list[Exchange] = []
    robots = []
    async with asyncio.TaskGroup() as group:
        tasks = []
        for number in range(participants):
            rng = np.random.default_rng(number)
            robot = Robot(
                base,
                at_random(rng),
                think=lambda rng=rng: float(rng.uniform(*THINK)),
                clips=True,
                exchanged=exchanges.append,
            )
            robots.append(robot)
            tasks.append(group.create_task(robot.take_part(invitation)))
            await asyncio.sleep(1.0 / RAMP)
        async with asyncio.timeout(PATIENCE):
            while not all(robot.answers for robot in robots):
                await asyncio.sleep(0.5)
        await asyncio.sleep(SETTLE)
        start = time.monotonic()
        await asyncio.sleep(window)
        end = time.monotonic()
        await asyncio.sleep(max(THINK))  # what was sent before the end is answered by now
        assert not any(task.done() for task in tasks), "too few comparisons for this long"
        for task in tasks:
            task.cancel()
    rows = summary([each for each in exchanges if start <= each.began < end], end - start)
    failed = Counter(str(each.status) for each in exchanges if not 200 <= each.status < 400)
    counts = {"all_requests": len(exchanges), "errors": dict(failed)}
    return {"participants": participants, **rows, **counts}


def summary(exchanges: list[Exchange], seconds: float) -> dict[str, Any]:
    """Milliseconds of the answers, and requests per second of all kinds."""
    of = {
        name: 1000.0 * np.array([each.seconds for each in exchanges if each.name == name])
        for name in ("answer", "watched", "trial")
    }
    p50, p95, p99, most = np.percentile(of["answer"], [50, 95, 99, 100]).round(1).tolist()
    return {
        "answers": len(of["answer"]),
        "p50_ms": p50,
        "p95_ms": p95,
        "p99_ms": p99,
        "max_ms": most,
        "watched_p95_ms": round(float(np.percentile(of["watched"], 95)), 1),
        "trial_p95_ms": round(float(np.percentile(of["trial"], 95)), 1),
        "answers_per_second": round(len(of["answer"]) / seconds, 1),
        "requests_per_second": round(len(exchanges) / seconds, 1),
    }


def _group(leader: int) -> list[int]:
    """The processes of a process group."""
    processes = (int(path.name) for path in Path("/proc").iterdir() if path.name.isdigit())
    found = []
    for process in processes:
        try:
            if os.getpgid(process) == leader:
                found.append(process)
        except ProcessLookupError:
            continue
    return found


def _processor_seconds(leader: int) -> float:
    """That a group has used so far."""
    ticks = 0
    for process in _group(leader):
        fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
        ticks += int(fields[11]) + int(fields[12])
    return ticks / os.sysconf("SC_CLK_TCK")


def _megabytes(process: int) -> float:
    """Resident memory."""
    pages = int(Path(f"/proc/{process}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


if __name__ == "__main__":
    address, link, count, window = sys.argv[1:]
    print(json.dumps(asyncio.run(put_under_load(address, link, int(count), float(window)))))
