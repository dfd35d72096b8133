from itertools import pairwise
from math import log

import pytest
from hypothesis import given
from hypothesis import strategies as st

from polite.methods.schedules import (
    EqualUpdates,
    Schedule,
    Session,
    decaying_rate,
    even_sessions,
    up_front,
)
from polite.rewards.trainer import updates_per_epoch
from polite.types import InvalidValueError

STRATEGIES = {"even": even_sessions, "decaying": decaying_rate, "up-front": up_front}


def test_the_paper_schedule() -> None:
    plan = Schedule().plan(queries=400, steps=1_000_000)
    assert plan == [Session(at=20_000 * k, queries=40) for k in range(10)]


@pytest.mark.parametrize("queries", [1, 3, 10, 23, 999])
def test_the_budget_is_spent_exactly_and_evenly(queries: int) -> None:
    plan = Schedule().plan(queries, 50_000)
    counts = [session.queries for session in plan]
    assert sum(counts) == queries
    assert max(counts) - min(counts) <= 1
    assert plan[0].at == 0  # the first session is never left out
    assert all(session.at < 0.2 * 50_000 for session in plan)


def test_no_queries_no_sessions() -> None:
    assert Schedule().plan(0, 1000) == []


@pytest.mark.parametrize(
    "change", [{"sessions": 0}, {"interval": 0.2}, {"segments_per_query": 1}, {"interval": -0.1}]
)
def test_impossible_schedules_are_refused(change) -> None:
    with pytest.raises(InvalidValueError, match="expected"):
        Schedule(**change)


# --- the others ----------------------------------------------------------------------------------


def test_a_decaying_rate_by_hand() -> None:
    # h is 2,000,000 steps, and there are sessions after 0, 1,000,000, 2,000,000 and 3,000,000. Of
    # the 75 queries after the first 25, ln 1.5 / ln 2.5 and ln 2 / ln 2.5 are due at those between.
    plan = Schedule(sessions=1, interval=0.25, strategy=decaying_rate).plan(100, 4_000_000)
    due = [25 + 75 * log(ratio) / log(2.5) for ratio in (1.0, 1.5, 2.0, 2.5)]
    assert [round(d) for d in due] == [25, 58, 82, 100]
    assert plan == [
        Session(0, 25), Session(1_000_000, 33), Session(2_000_000, 24), Session(3_000_000, 18)
    ]  # fmt: skip


def test_a_short_training_sees_a_rate_that_hardly_falls() -> None:
    plan = Schedule(interval=0.1, strategy=decaying_rate).plan(400, 10_000)
    assert plan[0] == Session(0, 100)
    assert [session.queries for session in plan[1:]] == [33, 34, 33, 33, 34, 33, 33, 34, 33]


def test_everything_up_front() -> None:
    assert Schedule(strategy=up_front).plan(400, 1_000_000) == [Session(0, 400)]


@given(
    st.sampled_from(list(STRATEGIES.values())),
    st.integers(0, 3000),
    st.integers(1, 10_000_000),
    st.integers(1, 30),
    st.floats(0.001, 1.0),
)
def test_every_plan_spends_the_budget_within_the_training(
    strategy, queries, steps, sessions, part
) -> None:
    schedule = Schedule(sessions=sessions, interval=part / sessions, strategy=strategy)
    plan = schedule.plan(queries, steps)
    assert sum(session.queries for session in plan) == queries
    assert all(session.queries > 0 for session in plan)
    times = [session.at for session in plan]
    assert times == sorted(times)
    assert strategy is even_sessions or len(set(times)) == len(times)
    assert all(0 <= time < steps for time in times)
    assert not plan or times[0] == 0


@given(st.integers(40, 2000), st.integers(100_000, 10_000_000), st.floats(0.02, 0.25))
def test_a_decaying_rate_never_rises(queries, steps, interval) -> None:
    plan = Schedule(sessions=1, interval=interval, strategy=decaying_rate).plan(queries, steps)
    assert plan[0].queries == round(0.25 * queries)
    later = [session.queries for session in plan[1:]]  # in whole numbers, one more or less than due
    assert all(second <= first + 1 for first, second in pairwise(later))


def updates(schedule: Schedule, budget: int, batch_size: int, steps: int = 1_000_000) -> list[int]:
    """Gradient updates after each session of a budget."""
    answers, done = 0, []
    for number, session in enumerate(schedule.plan(budget, steps), 1):
        answers += session.queries
        epochs = schedule.epochs(number, answers, batch_size, steps)
        done.append(epochs * updates_per_epoch(answers, batch_size))
    return done


def test_more_answers_mean_more_updates_unless_they_are_made_equal() -> None:
    # Minibatches of at most 128. 20, 40, …, 200 answers: one to 120, two from 140 on.
    assert updates(Schedule(), 200, 128) == [200, *[50] * 5, *[100] * 4]
    # 80, 160, …, 800 answers: 1, 2, 2, 3, 4, 4, 5, 5, 6, 7 minibatches.
    assert updates(Schedule(), 800, 128) == [200, 100, 100, 150, 200, 200, 250, 250, 300, 350]
    assert updates(EqualUpdates(), 800, 128) == [200, 50, 50, 51, 52, 52, 100, 100, 102, 105]
    assert updates(EqualUpdates(), 200, 128) == updates(Schedule(), 200, 128)


@given(
    budget=st.integers(1, 2000),
    reference=st.integers(1, 2000),
    batch_size=st.integers(1, 300),
    strategy=st.sampled_from(sorted(STRATEGIES)),
)
def test_equal_updates_are_equal_up_to_a_part_of_an_epoch(
    budget: int, reference: int, batch_size: int, strategy: str
) -> None:
    schedule = EqualUpdates(reference=reference, strategy=STRATEGIES[strategy])
    plan = schedule.plan(budget, 1_000_000)
    done = updates(schedule, budget, batch_size)
    copied = updates(Schedule(strategy=STRATEGIES[strategy]), reference, batch_size)
    answers = 0
    for session, here, there in zip(plan, done, copied, strict=False):
        answers += session.queries
        assert there <= here < there + updates_per_epoch(answers, batch_size)


def test_equal_updates_need_a_reference() -> None:
    with pytest.raises(InvalidValueError, match="reference ≥ 1"):
        EqualUpdates(reference=0)
    with pytest.raises(InvalidValueError, match="counts ≥ 1"):
        EqualUpdates(sessions=0)
