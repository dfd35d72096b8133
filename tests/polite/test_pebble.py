from dataclasses import replace

import numpy as np
import pytest
import torch
from stub_envs import register

from polite.dataset import Feedback
from polite.methods import pebble
from polite.methods.asking import joined_feedback, only_asked
from polite.methods.config import METHODS, Session
from polite.methods.pairs import ask_disputed, ask_uniformly
from polite.methods.pebble import last_steps, learn_pebble
from polite.methods.pebble_config import NET, PebbleConfig, PebbleSchedule, pebble_config
from polite.policies.sac import SacConfig
from polite.policies.vec_env import make_vec_env
from polite.rewards.ensemble import RewardEnsemble
from polite.rewards.network import RewardNetConfig, predict
from polite.rewards.trainer import RewardTrainingConfig
from polite.teachers.oracle import Oracle
from polite.types import (
    FIRST,
    SECOND,
    Answer,
    Highlight,
    InvalidValueError,
    PoliteError,
    Query,
    SegmentPool,
    Trajectory,
)

register()
SMALL = PebbleConfig(
    queries=7,
    steps=120,
    schedule=PebbleSchedule(
        unsupervised_steps=20,
        critic_updates=3,
        sessions=3,
        interval=24,
        segment_length=6,
        segments_per_query=6,
        recent_steps=60,
    ),
    net=RewardNetConfig(hidden=(8,), dropout=(0.0,)),
    training=RewardTrainingConfig(
        epochs=3, batch_size=4, highlight_length=2, learning_rate=1e-2, stop_accuracy=0.97
    ),
    sac=SacConfig(hidden=(8,), batch_size=8, random_steps=20),
)
ORACLE = Oracle(
    tie_threshold=0.0, positive_threshold=-9, negative_threshold=9, length=2, flip_probability=0.2
)


class InterruptionError(Exception):
    """The training is interrupted."""


def point(count, seed):
    return make_vec_env("Point-v0", count, seed)


def counting(count, seed):
    return make_vec_env("Counting-v0", count, seed, lengths=(5, 3, 7))


def learned(config=SMALL, seed=0, env=point, teacher=ORACLE.answer_queries, **rest):
    return learn_pebble(env, lambda pool: teacher, config, seed, **rest)


def interrupted_at(text, share):
    def report(says, done):
        if text in says and done >= share:
            raise InterruptionError

    return report


def assert_same(one, other):
    for a, b in zip(one.policy.weights, other.policy.weights, strict=True):
        np.testing.assert_array_equal(a, b)
    for a, b in zip(one.session_policy.weights, other.session_policy.weights, strict=True):
        np.testing.assert_array_equal(a, b)
    a, b = one.reward.state_dict(), other.reward.state_dict()
    assert all(torch.equal(a[name], b[name]) for name in a)
    assert one.feedback.queries == other.feedback.queries
    assert one.feedback.answers == other.feedback.answers
    for name, array in vars(one.feedback.pool).items():
        np.testing.assert_array_equal(array, getattr(other.feedback.pool, name))
    assert one.episodes == other.episodes
    assert one.sessions == other.sessions
    assert one.policy_steps == other.policy_steps


def differs(one, other):
    return any((a != b).any() for a, b in zip(one.weights, other.weights, strict=True))


def make_pool(size, steps=4, seed=0):
    rng = np.random.default_rng(seed)
    return SegmentPool(
        observations=rng.normal(size=(size, steps, 2)),
        actions=rng.normal(size=(size, steps, 1)),
        rewards=rng.normal(size=(size, steps)),
        states=rng.normal(size=(size, steps, 3)),
        lengths=rng.integers(2, steps, size, endpoint=True),
        trajectory=np.arange(size) // 2,
        start=np.arange(size),
    )


@pytest.fixture(scope="module")
def never_stopped():
    return {env: learned(env=env) for env in (point, counting)}


# --- when it asks --------------------------------------------------------------------------------


def test_four_hundred_queries_over_a_quarter_of_a_million_steps():
    config = PebbleConfig(queries=400, steps=250_000)
    plan = config.schedule.plan(config.queries, config.steps, config.first_session)
    assert plan == [Session(at=10_000 + 20_000 * k, queries=40) for k in range(10)]
    assert config.net == NET and config.training.stop_accuracy == 0.97


@pytest.mark.parametrize("steps", [10_001, 30_000, 30_001, 60_000, 1_000_000])
@pytest.mark.parametrize("queries", [1, 7, 400])
def test_the_whole_budget_is_spent_in_the_sessions_that_there_is_time_for(steps, queries):
    plan = PebbleSchedule().plan(queries, steps, first=10_000)
    counts = [session.queries for session in plan]
    assert sum(counts) == queries and max(counts) - min(counts) <= 1
    assert plan[0].at == 10_000 and plan[-1].at < steps
    if queries == 400:
        assert len(plan) == min(10, 1 + (steps - 1 - 10_000) // 20_000)


@pytest.mark.parametrize("steps", [500, 5_000, 250_000, 1_000_000])
def test_a_short_training_has_all_its_sessions_too(steps):
    config = pebble_config(400, steps, method=METHODS["polite"], sac=SacConfig(num_envs=2))
    plan = config.schedule.plan(config.queries, config.steps, config.first_session)
    assert [session.queries for session in plan] == [40] * 10
    share = min(1, steps / 250_000)
    assert plan[0].at == share * 10_000 and plan[-1].at == share * 190_000
    assert config.method == METHODS["polite"] and config.sac.num_envs == 2
    if steps >= 250_000:
        assert config.schedule == PebbleSchedule()


@pytest.mark.parametrize(
    "change",
    [
        {"steps": 40},
        {"queries": 0},
        {"members": 1},
        {"method": METHODS["untrained"]},
    ],
)
def test_settings_that_do_not_fit_are_refused(change):
    with pytest.raises(InvalidValueError, match="expected"):
        replace(SMALL, **change)


@pytest.mark.parametrize(
    "change",
    [{"neighbours": 0}, {"interval": 0}, {"unsupervised_steps": -1}, {"segments_per_query": 1}],
)
def test_impossible_schedules_are_refused(change):
    with pytest.raises(InvalidValueError, match="≥ 1"):
        PebbleSchedule(**change)


# --- what it asks about --------------------------------------------------------------------------


def test_chance_chooses_first_and_then_the_sampler_that_is_set():
    calls = []

    def noted(request, model):
        calls.append((len(request.pool), request.count, len(model)))
        return request.draw()

    learned(replace(SMALL, sampler=noted))
    assert calls == [(2 * 6, 2, 3)] * 2  # the second and the third session
    assert PebbleConfig(queries=1, steps=20_000).sampler is ask_disputed


def test_only_segments_that_were_asked_about_are_kept():
    pool = make_pool(10)
    pairs = [Query(7, 2), Query(2, 9), Query(0, 7)]
    kept, moved = only_asked(pool, pairs)
    assert len(kept) == 4
    for pair, new in zip(pairs, moved, strict=True):
        for old_place, new_place in ((pair.first, new.first), (pair.second, new.second)):
            for name in ("observations", "rewards", "states", "start", "lengths"):
                np.testing.assert_array_equal(
                    getattr(pool, name)[old_place], getattr(kept, name)[new_place]
                )


def test_joined_feedback_keeps_who_was_asked_what():
    first = Feedback(make_pool(3), [Query(0, 1), Query(2, 1)], [Answer(1, SECOND)])
    answer = Answer(0, FIRST, positive=Highlight(1, 2))
    second = Feedback(make_pool(2, seed=1), [Query(1, 0)], [answer])
    assert joined_feedback(None, second) is second
    both = joined_feedback(first, second)
    assert both.queries == [Query(0, 1), Query(2, 1), Query(4, 3)]
    assert both.answers == [Answer(1, SECOND), replace(answer, query=2)]
    np.testing.assert_array_equal(both.pool.states[3:], second.pool.states)


def test_the_last_trajectories_are_those_that_are_needed():
    rows = [np.zeros((k, 1)) for k in (5, 3, 4)]
    trajectories = [Trajectory(r, r, r[:, 0], r, terminated=True) for r in rows]
    for steps, kept in ((1, [4]), (4, [4]), (5, [3, 4]), (8, [5, 3, 4]), (99, [5, 3, 4])):
        assert [len(t) for t in last_steps(trajectories, steps)] == kept
    assert last_steps([], 5) == []


def test_segments_end_with_their_episode_and_reach_its_last_step():
    result = learned(replace(SMALL, queries=30), env=counting)
    pool, ends = result.feedback.pool, []
    for index in range(len(pool)):
        steps, episodes = pool[index].observations.T
        assert (np.diff(steps) == 1).all() and len(set(episodes)) == 1
        ends.append((int(episodes[0]) % 3, int(steps[-1])))
    assert pool.lengths.max() == 6
    assert {(0, 4), (1, 2), (2, 6)} <= set(ends)  # the last steps of episodes of 5, 3 and 7


# --- the loop ------------------------------------------------------------------------------------


def test_the_budget_is_asked_on_time_and_everything_is_trained():
    asked, firsts = [], []

    def teacher(pool, queries, rng):
        asked.append((len(pool), len(queries)))
        return ORACLE.answer_queries(pool, queries, rng)

    def make_teacher(pool):
        firsts.append(len(pool))
        return teacher

    result = learn_pebble(point, make_teacher, SMALL, 0)
    assert firsts == [3 * 6]
    assert [queries for _, queries in asked] == [3, 2, 2]
    assert all(segments <= 2 * queries for segments, queries in asked)
    assert len(result.feedback.answers) == len(result.feedback.queries) == 7
    assert result.sessions == [40, 64, 88]
    assert result.policy_steps == 120 and result.collection_steps == 0
    # envs begin anew at 40, 64 and 88: of 20 steps each, these episodes were finished
    assert [episode["step"] for episode in result.episodes] == [20, 40, 60, 84, 108]
    assert all(-40 < episode["return"] < 20 for episode in result.episodes)
    assert all(np.isfinite(weight).all() for weight in result.policy.weights)
    assert isinstance(result.reward, RewardEnsemble) and len(result.reward) == 3
    assert differs(result.policy, result.session_policy)


def test_the_replay_holds_the_reward_as_it_is_after_each_session(monkeypatch):
    seen = []

    class Spy(pebble._Learner):
        def hold(self, session):
            before = self._trainer.replay.rewards.copy()
            paid = self._trainer.replay.intrinsic
            super().hold(session)
            replay = self._trainer.replay
            expected = predict(self._ensemble, replay.observations[:, 0], replay.actions[:, 0])
            np.testing.assert_allclose(replay.rewards[:, 0], expected, atol=1e-5)
            seen.append((replay.full, np.abs(replay.rewards - before).min(), paid is None))
            assert replay.intrinsic is None

    monkeypatch.setattr(pebble, "_Learner", Spy)
    sac = replace(SMALL.sac, replay_size=30)  # written past its end before the first session
    learned(replace(SMALL, sac=sac))
    assert [full for full, _, _ in seen] == [True] * 3
    assert all(change > 0 for _, change, _ in seen)
    assert [learned_pays for _, _, learned_pays in seen] == [False, True, True]


def test_the_learner_never_sees_the_true_reward():
    def first_always(pool, queries, rng):
        return [Answer(k, FIRST) for k in range(len(queries))]

    class Richer:
        """The same envs, but each step pays twice as much and 5 more."""

        def __call__(self, count, seed):
            env = point(count, seed)
            step = env.vector_env.step

            def richer(actions):
                observations, rewards, *rest = step(actions)
                return observations, 2 * rewards + 5, *rest

            env.vector_env.step = richer
            return env

    poor, rich = (learned(env=env, teacher=first_always) for env in (point, Richer()))
    assert not differs(poor.policy, rich.policy)
    for one, other in zip(poor.episodes, rich.episodes, strict=True):
        assert other["return"] == pytest.approx(2 * one["return"] + 5 * one["length"], rel=1e-5)


def test_the_reward_models_learn_what_the_teacher_prefers():
    training = replace(SMALL.training, epochs=40)
    teacher = replace(ORACLE, flip_probability=0.0).answer_queries
    result = learned(replace(SMALL, queries=90, training=training), teacher=teacher)
    places = np.linspace(-1.0, 1.0, 20)[:, None]
    rewards = predict(result.reward, places, np.zeros((20, 1)))
    assert np.corrcoef(rewards, places[:, 0])[0, 1] > 0.7


def test_equal_seeds_give_equal_results(never_stopped):
    first, second, other = never_stopped[point], learned(), learned(seed=2)
    assert_same(first, second)
    assert differs(first.policy, other.policy)


def test_highlights_are_trained_on_where_the_method_says_so():
    results = [
        learned(replace(SMALL, method=METHODS[name]))
        for name in ("preferences", "polite", "highlights")
    ]
    weights = [torch.cat([p.flatten() for p in r.reward.parameters()]) for r in results]
    assert results[0].feedback.answers[:3] == results[1].feedback.answers[:3]
    assert not torch.equal(weights[0], weights[1])
    assert not torch.equal(weights[0], weights[2])
    assert not torch.equal(weights[1], weights[2])


def test_the_true_reward_gives_a_ceiling_and_asks_nobody():
    config = replace(SMALL, method=METHODS["ground-truth"], queries=0)
    result = learned(config, teacher=None)
    assert result.reward is None and result.feedback is None and result.sessions == []
    assert result.policy_steps == 120
    assert len(result.episodes) == 6  # one stretch


def test_several_envs_step_together():
    sac = replace(SMALL.sac, num_envs=3, batch_size=8)
    result = learned(replace(SMALL, sac=sac))
    assert result.sessions == [42, 66, 90]  # the first whole steps of all from 40, 64, 88 on
    assert result.policy_steps == 120


def test_progress_and_episodes_are_told_and_never_go_back():
    said, followed = [], []
    learned(
        report=lambda says, share: said.append((says, share)),
        follow=lambda episodes: followed.append(len(episodes)),
    )
    shares = [share for _, share in said]
    assert shares == sorted(shares) and shares[0] == 0.0 and shares[-1] == 1.0
    assert "gathering new states" in {says for says, _ in said}
    assert "session 3 of 3: reward models, epoch 3 of 3" in {says for says, _ in said}
    assert followed == sorted(followed) and followed[0] == 0 and followed[-1] == 5


# --- going on ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("env", "text", "share"),
    [
        (point, "asking", 0.0),  # before anything was written
        (point, "training", 0.4),  # just after the first session
        (counting, "training", 0.5),  # a little later, in an env that counts its episodes
        (point, "relabelling", 0.7),  # in the third session, which is held again
        (counting, "training", 1.0),  # at the very end
    ],
)
def test_an_interrupted_training_ends_with_the_same_numbers(
    tmp_path, never_stopped, env, text, share
):
    path, whole = tmp_path / "pebble.pt", never_stopped[env]
    with pytest.raises(InterruptionError):
        learned(env=env, checkpoint=path, report=interrupted_at(text, share))
    assert path.exists() == (text != "asking")
    np.random.seed(123)
    torch.manual_seed(123)
    assert_same(whole, learned(env=env, checkpoint=path))
    assert [p.name for p in tmp_path.iterdir()] == ["pebble.pt"]


def test_a_training_can_be_interrupted_again_and_again(tmp_path):
    path = tmp_path / "pebble.pt"
    sac = replace(SMALL.sac, num_envs=2, replay_size=30)
    config = replace(SMALL, sac=sac, method=METHODS["polite"])
    whole = learned(config)
    for share in (0.4, 0.6, 0.8):
        with pytest.raises(InterruptionError):
            learned(config, checkpoint=path, report=interrupted_at("training", share))
    assert_same(whole, learned(config, checkpoint=path))


def test_what_was_asked_is_not_asked_again(tmp_path):
    path, asked = tmp_path / "pebble.pt", []

    def teacher(pool, queries, rng):
        asked.append(len(queries))
        return ORACLE.answer_queries(pool, queries, rng)

    with pytest.raises(InterruptionError):
        learned(teacher=teacher, checkpoint=path, report=interrupted_at("training", 0.6))
    assert asked == [3, 2]
    result = learned(teacher=teacher, checkpoint=path)
    assert asked == [3, 2, 2]
    assert len(result.feedback.answers) == 7


def test_settings_read_the_same_in_every_process():
    assert "ask_disputed" in str(SMALL)
    assert " at 0x" not in str(SMALL)


def test_a_checkpoint_of_another_training_is_refused(tmp_path):
    path = tmp_path / "pebble.pt"
    learned(checkpoint=path)
    sampler = {"config": replace(SMALL, sampler=ask_uniformly)}
    for other in ({"seed": 1}, {"config": replace(SMALL, queries=8)}, sampler):
        with pytest.raises(PoliteError, match=r"other settings; remove it"):
            learned(checkpoint=path, **other)


@pytest.mark.parametrize("content", [b"", b"no checkpoint", b"PK\x03\x04"])
def test_a_damaged_checkpoint_is_a_one_line_error(tmp_path, content):
    path = tmp_path / "pebble.pt"
    path.write_bytes(content)
    with pytest.raises(PoliteError, match="remove it to begin anew") as caught:
        learned(checkpoint=path)
    assert "\n" not in str(caught.value)


def test_a_pickle_is_not_opened(tmp_path):
    path = tmp_path / "pebble.pt"

    class Dangerous:
        def __reduce__(self):
            return (path.with_name("ran").touch, ())

    torch.save({"identity": Dangerous(), "content": {}}, path)
    with pytest.raises(PoliteError, match="remove it to begin anew"):
        learned(checkpoint=path)
    assert not path.with_name("ran").exists()
