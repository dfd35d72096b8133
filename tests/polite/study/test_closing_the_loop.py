"""From the pages to a reward model: what robots say in a browser is what the learner learns."""

import asyncio

import numpy as np
import pytest
import torch
from browser_robots import Oracle, robots_answer
from browsers import ServedStudy, needs_browser
from scipy.stats import binom

from polite.analysis.quality import pair_accuracy
from polite.dataset import Feedback, load_feedback, save_feedback
from polite.experiments.replication.config import PRESETS
from polite.experiments.replication.world import study_env
from polite.files import read_json_object
from polite.rewards.data import stack_feedback
from polite.rewards.network import FAST, RewardNet, predict
from polite.rewards.trainer import RewardTrainingConfig, train_reward
from polite.rollouts import collect
from polite.samplers import uniform_pairs
from polite.segments import cut_segments
from polite.study.clips import prepare_clips
from polite.study.export import export
from polite.study.folder import StudyFolder
from polite.study.quality import catch_results
from polite.study.reading import read_records
from polite.types import FIRST, SECOND

PARTICIPANTS, COMPARISONS, LENGTH = 3, 12, 3
STANDS_OUT = 0.005
HELD_OUT_PAIRS = 300
CHANCE = 1e-3
"""A coin orders as many held-out pairs rightly with at most this probability."""

DESIGN = f"""
title = "Robots try the study out"
contact = "nobody@example.org"
answered_by = "robots"
env = "socialnav_env:SocialCorridor-v0"
env_settings = {{ render_width = 96 }}
participants = {PARTICIPANTS}
comparisons = {COMPARISONS}
repeated = 1
mirrored = 1
highlight_length = {LENGTH}
speeds = [1.0, 4.0]

[consent]
version = "1"
text = "Robots take part."

[guide]
text = "Look at the true reward."
good = {{ segment = 0, start = 2, text = "It is high." }}
bad = {{ segment = 1, start = 5, text = "It is low." }}

[[practice]]
first = 0
second = 1
expected = "first"
explanation = "Whatever this says."

[[questions]]
name = "demanding"
text = "How demanding was it?"
kind = "scale"

[exclusion]
fast_seconds = 0  # robots do not think
"""


def drive_about(seed, count):
    """Segments of robots that now and then choose another direction and speed."""
    rng = np.random.default_rng(seed)
    trajectories = []
    for start in (-12.0, -8.0, -4.0, 0.0, 4.0, 8.0):
        env = study_env(PRESETS["smoke"], 8, 0, start_z=start).vector_env
        chosen = rng.uniform(-1, 1, (8, 2))

        def act(observations, chosen=chosen):
            turning = rng.random(len(observations)) < 0.1
            chosen[turning] = rng.uniform(-1, 1, (turning.sum(), 2))
            return chosen.astype(np.float32)

        trajectories += collect(env, act, 48, int(rng.integers(1000)))
    return cut_segments(trajectories, 16, count, rng)


@pytest.fixture(scope="module")
def answered_by_robots(tmp_path_factory):
    """A study that robots went through: its folder, its records and its export."""
    path = tmp_path_factory.mktemp("loop") / "study"
    pool = drive_about(0, 60)
    pairs = uniform_pairs(PARTICIPANTS * COMPARISONS, np.random.default_rng(0), pool)
    save_feedback(path / "pool", Feedback(pool, pairs))
    (path / "study.toml").write_text(DESIGN, encoding="utf-8")
    folder = StudyFolder(path)
    prepare_clips(path, folder.design, folder.feedback)
    served = ServedStudy(folder)
    try:
        links = [served.invitation() for _ in range(2 * PARTICIPANTS)]
        asyncio.run(robots_answer(folder, links, STANDS_OUT))
        with served.database.read() as connection:
            records = read_records(connection)
    finally:
        served.stop()
        served.database.close()
    return folder, records, export(path, records, path.parent / "export")


@needs_browser
def test_the_export_is_what_the_oracle_says(answered_by_robots):
    folder, records, exported = answered_by_robots
    pool, queries = folder.feedback.pool, folder.feedback.queries
    oracle = Oracle(pool, LENGTH, STANDS_OUT)
    sides = {trial.first_is_left for person in records.participants for trial in person.trials}
    assert sides == {True, False}
    marked = {"good": 0, "bad": 0, "nothing": 0}
    for condition in ("polite", "baseline"):
        feedback = load_feedback(exported / "data" / condition)
        np.testing.assert_array_equal(feedback.pool.rewards, pool.rewards)
        assert feedback.queries == queries
        assert sorted(answer.query for answer in feedback.answers) == [*range(len(queries))]
        for answer in feedback.answers:
            first, second = queries[answer.query].first, queries[answer.query].second
            second_is_better = pool.rewards[second].sum() > pool.rewards[first].sum()
            assert answer.preference == (SECOND if second_is_better else FIRST)
            windows = oracle.windows(second if second_is_better else first)
            expected = windows if condition == "polite" else {}
            marks = {"good": answer.positive, "bad": answer.negative}
            assert {n: mark.start for n, mark in marks.items() if mark} == expected
            assert all(mark.end == mark.start + LENGTH for mark in marks.values() if mark)
            for name in windows or ["nothing"]:
                marked[name] += 1
    assert min(marked.values()) > 5, f"the pool lets robots show too little: {marked}"


@needs_browser
def test_robots_are_consistent_and_nobody_is_excluded(answered_by_robots):
    _, records, exported = answered_by_robots
    summary = read_json_object(exported / "export.json", "")
    assert summary["simulated_by"] == "robots"
    for counts in summary["conditions"].values():
        assert counts["joined"] == counts["finished"] == counts["included"] == PARTICIPANTS
        assert set(counts["excluded"].values()) == {0}
        assert counts["answers"] == PARTICIPANTS * COMPARISONS
    outcomes = [result for person in records.participants for result in catch_results(person)]
    assert {result.kind for result in outcomes} == {"repeated", "mirrored"}
    assert {result.outcome for result in outcomes} == {"agreed"}
    assert len(outcomes) == 2 * PARTICIPANTS * 2


@needs_browser
@pytest.mark.parametrize("condition", ["polite", "baseline"])
def test_a_reward_model_orders_what_no_robot_saw_as_the_oracle_does(
    answered_by_robots, condition, record_property
):
    """Each held-out segment is in one pair, so that pairs count independently."""
    *_, exported = answered_by_robots
    feedback = load_feedback(exported / "data" / condition)
    pool = feedback.pool
    generator = torch.Generator().manual_seed(0)
    net = RewardNet(pool.observations.shape[-1], pool.actions.shape[-1], FAST, generator)
    net.standardise(pool)
    data = stack_feedback(Feedback(pool, feedback.queries, feedback.answers))
    train_reward(net, data, RewardTrainingConfig(highlight_length=LENGTH), generator)

    unseen = drive_about(1, 2 * HELD_OUT_PAIRS)
    returns = predict(net, unseen.observations, unseen.actions).sum(axis=1)
    pairs = np.arange(2 * HELD_OUT_PAIRS).reshape(-1, 2)
    accuracy = pair_accuracy(returns, unseen.returns, pairs)
    record_property(f"held-out accuracy, {condition}", accuracy)
    print(f"{condition}: {accuracy:.3f} of {HELD_OUT_PAIRS} held-out pairs")
    assert binom.sf(round(accuracy * HELD_OUT_PAIRS) - 1, HELD_OUT_PAIRS, 0.5) < CHANCE
