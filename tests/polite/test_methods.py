from dataclasses import replace

import numpy as np
import pytest
import torch
from stub_envs import register

from polite.dataset import Feedback
from polite.methods.config import METHODS, LearningConfig
from polite.methods.history import FeedbackHistory, join_pools
from polite.methods.pairs import PAIR_SAMPLERS
from polite.methods.preference_learning import learn
from polite.methods.presets import PRESETS, preset_of, quantile_oracle
from polite.methods.schedules import EqualUpdates, Schedule, decaying_rate, up_front
from polite.policies.ppo import PpoConfig
from polite.policies.vec_env import make_vec_env
from polite.rewards import trainer
from polite.rewards.data import stack_feedback
from polite.rewards.ensemble import RewardEnsemble
from polite.rewards.network import RewardNetConfig, predict
from polite.rewards.trainer import RewardTrainingConfig, batch_loss
from polite.samplers import uniform_pairs
from polite.teachers.oracle import Oracle
from polite.types import InvalidValueError, PoliteError, Segment, SegmentPool

register()
SMALL = LearningConfig(
    method=METHODS["polite"],
    queries=8,
    steps=256,
    schedule=Schedule(sessions=4, interval=0.125, segment_length=6, first_epochs=5, later_epochs=2),
    net=RewardNetConfig(hidden=(8,), dropout=(0.0,)),
    training=RewardTrainingConfig(batch_size=4, highlight_length=2, learning_rate=1e-2),
    ppo=PpoConfig(num_envs=2, rollout=16, batch_size=16, epochs=2, hidden=(8,)),
)
ORACLE = Oracle(
    tie_threshold=0.0, positive_threshold=-9, negative_threshold=9, length=2, flip_probability=0.0
)


def make_env(count, seed):
    return make_vec_env("Point-v0", count, seed)


def learned(method="polite", seed=0, env=make_env, report=lambda says, share: None, **changes):
    config = replace(SMALL, method=METHODS[method], **changes)
    return learn(env, lambda pool: ORACLE.answer_queries, config, seed, report)


def make_pool(size, first=0.0, trajectory=0):
    segments = [
        Segment(
            observations=np.full((4, 2), first + i),
            actions=np.zeros((4, 1)),
            rewards=np.full(4, first + i),
            states=np.zeros((4, 1)),
            trajectory=trajectory,
            start=i,
        )
        for i in range(size)
    ]
    return SegmentPool.stack(segments, 5)


# --- the settings --------------------------------------------------------------------------------


@pytest.mark.parametrize("change", [{"queries": 0}, {"steps": 0}, {"members": 0}])
def test_impossible_budgets_are_refused(change) -> None:
    with pytest.raises(InvalidValueError, match="≥ 1"):
        replace(SMALL, **change)
    if "queries" in change:  # which is nothing to those who do not ask
        replace(SMALL, method=METHODS["ground-truth"], **change)


@pytest.mark.parametrize("offset", [np.nan, np.inf])
def test_an_offset_that_is_not_finite_is_refused(offset) -> None:
    with pytest.raises(InvalidValueError, match="finite reward_offset"):
        replace(SMALL, reward_offset=offset)


@pytest.mark.parametrize("name", ["disagreement", "disputed-k-centre"])
def test_one_reward_model_cannot_disagree(name: str) -> None:
    with pytest.raises(InvalidValueError, match="members ≥ 2"):
        replace(SMALL, sampler=PAIR_SAMPLERS[name])
    replace(SMALL, sampler=PAIR_SAMPLERS[name], members=2)


# --- the history ---------------------------------------------------------------------------------


def test_joined_pools_keep_their_order_and_tell_their_trajectories_apart() -> None:
    joined = join_pools([make_pool(2, 0.0), make_pool(3, 10.0, trajectory=1), make_pool(1, 20.0)])
    assert joined.returns.tolist() == [0, 4, 40, 44, 48, 80]
    assert joined.trajectory.tolist() == [0, 0, 2, 2, 2, 3]


def test_pairs_come_from_the_recent_sessions_only() -> None:
    history, asked = FeedbackHistory(recent_sessions=2), []

    def teacher(pool, queries, rng):
        asked.append(pool)
        return ORACLE.answer_queries(pool, queries, rng)

    for number in range(4):
        history.add_segments(make_pool(5, 100.0 * number))
        history.ask(6, teacher, np.random.default_rng(number))
    feedback = history.feedback
    assert len(feedback.pool) == 20
    assert [len(pool) for pool in asked] == [5, 10, 10, 10]
    for number, query in enumerate(feedback.queries):
        session = number // 6
        low, high = max(0, session - 1) * 5, (session + 1) * 5
        assert low <= min(query.first, query.second) < max(query.first, query.second) < high


def test_answers_still_fit_their_queries_after_many_sessions() -> None:
    history = FeedbackHistory(recent_sessions=1)
    for number in range(3):
        history.add_segments(make_pool(4, 10.0 * number))
        history.ask(5, ORACLE.answer_queries, np.random.default_rng(number))
    feedback = history.feedback
    assert [answer.query for answer in feedback.answers] == list(range(15))
    for answer in feedback.answers:
        query = feedback.queries[answer.query]
        better = feedback.pool.returns[query.second] > feedback.pool.returns[query.first]
        assert answer.preferred == int(better)


# --- the loop ------------------------------------------------------------------------------------


def test_polite_asks_its_budget_and_trains_both_models() -> None:
    result = learned()
    assert result.feedback is not None and result.reward is not None
    assert len(result.feedback.queries) == len(result.feedback.answers) == 8
    assert len(result.feedback.pool) == 8 * 5
    assert result.sessions == [0, 32, 64, 96]
    assert result.policy_steps == 256
    # 10 segments of 6 steps a session: 3 envs for the 20 steps of an episode; before, 100 segments
    assert result.collection_steps == 4 * 3 * 20 + 30 * 20
    assert len(result.episodes) == 12  # 2 envs, 128 steps each, 20 steps an episode
    assert all(np.isfinite(weight).all() for weight in result.policy.weights)


def test_the_reward_model_learns_what_the_teacher_prefers() -> None:
    result = learned(queries=60)
    places = np.linspace(-1.0, 1.5, 20)[:, None]
    rewards = predict(result.reward, places, np.zeros((20, 1)))
    assert np.corrcoef(rewards, 1.0 - np.abs(places[:, 0] - 1.0))[0, 1] > 0.7


def test_equal_seeds_give_equal_results() -> None:
    first, second, other = learned(seed=1), learned(seed=1), learned(seed=2)
    for a, b in zip(first.policy.weights, second.policy.weights, strict=True):
        np.testing.assert_array_equal(a, b)
    assert first.feedback.answers == second.feedback.answers
    assert first.episodes == second.episodes
    assert first.episodes != other.episodes


@pytest.mark.parametrize("show_ends", [False, True])
def test_clips_are_cut_short_by_early_ends_only_where_they_are_shown(show_ends: bool) -> None:
    def ending(count, seed):
        return make_vec_env("Counting-v0", count, seed, lengths=(7,))

    result = learned(env=ending, schedule=replace(SMALL.schedule, show_ends=show_ends))
    lengths = set(result.feedback.pool.lengths.tolist())
    assert lengths <= {1, 2, 3, 4, 5, 6}  # 1: an episode of 7, then one that 8 steps cut off
    assert bool(lengths & {2, 3, 4, 5}) == show_ends


def test_few_clips_may_come_from_any_part_of_an_episode() -> None:
    """Once they came from its first steps, as many as the clips have."""
    few = replace(SMALL.schedule, segments_per_query=2)  # 12 steps of an episode of 20
    starts = learned(queries=4, schedule=few).feedback.pool.start
    assert starts.max() > 6 > starts.min()


def test_equal_updates_train_the_reward_model_as_often_whatever_the_budget(monkeypatch) -> None:
    steps: list[int] = []
    true_loss = trainer.batch_loss

    def counted(rewards, data, batch, config):
        steps.append(len(data))
        return true_loss(rewards, data, batch, config)

    monkeypatch.setattr(trainer, "batch_loss", counted)

    def updates(schedule, queries):
        steps.clear()
        learned("preferences", queries=queries, schedule=schedule)
        return {answers: steps.count(answers) for answers in dict.fromkeys(steps)}

    plain = SMALL.schedule
    equal = EqualUpdates(
        sessions=4, interval=0.125, segment_length=6, first_epochs=5, later_epochs=2, reference=8
    )
    # Minibatches of at most 4: 2, 4, 6, 8 answers are 1, 1, 2, 2 of them; 8, 16, 24, 32 are 2 to 8.
    assert updates(plain, 8) == updates(equal, 8) == {2: 5, 4: 2, 6: 4, 8: 4}
    assert updates(plain, 32) == {8: 10, 16: 8, 24: 12, 32: 16}
    assert updates(equal, 32) == {8: 6, 16: 4, 24: 6, 32: 8}


def test_ground_truth_asks_nobody_and_pays_the_env_reward() -> None:
    result = learned("ground-truth")
    assert result.reward is None and result.feedback is None
    assert result.collection_steps == 0 and result.sessions == []


@pytest.mark.parametrize(
    "change",
    [
        {"queries": 40},
        {"ppo": replace(SMALL.ppo, log_std=-3.0)},  # a policy that hardly moves
        {"method": "preferences"},
        {"method": "untrained"},
    ],
)
def test_the_reward_model_sees_inputs_as_random_actions_make_them(change) -> None:
    reward = learned().reward
    assert reward.std[1] == pytest.approx(2 / np.sqrt(12), abs=0.05)  # uniform in [-1, 1]
    assert reward.mean[1] == pytest.approx(0.0, abs=0.1)
    other = learned(**change).reward
    assert torch.equal(other.mean, reward.mean) and torch.equal(other.std, reward.std)


def test_untrained_keeps_the_first_reward_model_of_all_methods() -> None:
    untrained = learned("untrained")
    assert untrained.feedback is None
    start = learned("polite", training=replace(SMALL.training, learning_rate=1e-12))
    for a, b in zip(untrained.reward.parameters(), start.reward.parameters(), strict=True):
        torch.testing.assert_close(a, b, atol=1e-8, rtol=0.0)
    torch.testing.assert_close(untrained.reward.mean, start.reward.mean)


def test_methods_differ_in_what_they_learn_from_and_in_nothing_else() -> None:
    results = [learned(name) for name in ("polite", "preferences", "highlights")]
    first = [result.feedback.answers[:2] for result in results]  # before anything was learned
    assert first[0] == first[1] == first[2]
    weights = [torch.cat([p.flatten() for p in r.reward.parameters()]) for r in results]
    assert not torch.equal(weights[0], weights[1])
    assert not torch.equal(weights[0], weights[2])
    assert not torch.equal(weights[1], weights[2])


def test_without_preferences_only_the_highlight_terms_remain() -> None:
    pool = make_pool(6)
    history = FeedbackHistory(1)
    history.add_segments(pool)
    history.ask(10, ORACLE.answer_queries, np.random.default_rng(0))
    feedback: Feedback = history.feedback
    data = stack_feedback(feedback)
    config, batch = RewardTrainingConfig(highlight_length=2), torch.arange(10)
    rewards = torch.randn(10, 2, 5, generator=torch.Generator().manual_seed(0))
    none = config.without_highlights()
    both = batch_loss(rewards, data, batch, config)
    preferences = batch_loss(rewards, data, batch, none)
    highlights = batch_loss(rewards, data.without_preferences(), batch, config)
    torch.testing.assert_close(both, preferences + highlights)
    assert batch_loss(rewards, data.without_preferences(), batch, none).item() == 0.0


def test_progress_is_told_and_never_goes_back() -> None:
    said = []
    learned(report=lambda says, share: said.append((says, share)))
    shares = [share for _, share in said]
    assert shares == sorted(shares) and shares[0] == 0.0 and shares[-1] == 1.0
    texts = {says for says, _ in said}
    assert "session 1 of 4: collecting segments" in texts
    assert "session 4 of 4: reward model, epoch 2 of 2" in texts


def test_segments_end_with_their_episode() -> None:
    result = learned(env=lambda count, seed: make_vec_env("Counting-v0", count, seed))
    assert result.feedback.pool.lengths.max() == 5  # episodes of 5 steps, segments of up to 6
    assert result.feedback.pool.mask.sum() == result.feedback.pool.lengths.sum()


def test_an_env_whose_observations_are_no_vector_is_refused() -> None:
    class Matrix:
        def __call__(self, count, seed):
            env = make_env(count, seed)
            env.observation_space = type(env.observation_space)(-1.0, 1.0, (2, 2))
            return env

    with pytest.raises(PoliteError, match="vectors"):
        learned(env=Matrix())


# --- ensembles, samplers, schedules ---------------------------------------------------------------


def test_several_reward_models_begin_as_the_one_and_pay_their_mean() -> None:
    one, several = learned("untrained"), learned("untrained", members=3)
    assert isinstance(several.reward, RewardEnsemble) and len(several.reward) == 3
    member = several.reward.member(0)
    for name, tensor in one.reward.state_dict().items():
        torch.testing.assert_close(member.state_dict()[name], tensor)
    assert not torch.equal(several.reward.weights[0][0], several.reward.weights[0][1])


def test_several_reward_models_are_all_trained_and_equal_seeds_give_equal_ones() -> None:
    first, second, untrained = (
        learned(name, members=2) for name in ("polite", "polite", "untrained")
    )
    for index, weight in enumerate(first.reward.weights):
        assert torch.equal(weight, second.reward.weights[index])
        for member in range(2):
            assert not torch.equal(weight[member], untrained.reward.weights[index][member])


@pytest.mark.parametrize("name", PAIR_SAMPLERS)
def test_every_sampler_serves_the_loop(name: str) -> None:
    uniform = learned(members=2)
    result = learned(members=2, sampler=PAIR_SAMPLERS[name])
    assert len(result.feedback.answers) == 8
    pairs = {frozenset((q.first, q.second)) for q in result.feedback.queries}
    assert len(pairs) == 8
    first = [r.feedback.queries[:2] for r in (uniform, result)]
    assert first[0] == first[1]  # the first session asks about any pairs
    assert (result.feedback.queries == uniform.feedback.queries) == (name == "uniform")


@pytest.mark.parametrize("strategy", [decaying_rate, up_front])
def test_every_schedule_serves_the_loop(strategy) -> None:
    schedule = replace(SMALL.schedule, strategy=strategy)
    result = learned(schedule=schedule)
    plan = schedule.plan(8, 256)
    assert len(result.feedback.answers) == sum(session.queries for session in plan) == 8
    assert len(result.sessions) == len(plan)
    for held, session in zip(result.sessions, plan, strict=True):
        assert session.at <= held < session.at + 32  # at the end of a rollout of 2 × 16 steps


def test_a_normalised_reward_spreads_by_1_about_its_offset_over_the_segments_so_far() -> None:
    for method, members in (("polite", 1), ("polite", 3), ("untrained", 1)):
        result = learned(method, normalise=True, members=members, reward_offset=2.0)
        assert result.reward.scale.shape == (members,)
        assert not torch.equal(result.reward.scale, torch.ones(members))
        if method == "polite":
            pool = result.feedback.pool
            paid = predict(result.reward, pool.observations, pool.actions)[pool.mask]
            assert paid.mean() == pytest.approx(2.0, abs=1e-4)
            assert members > 1 or paid.std() == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("normalised", [False, True])
def test_a_raised_reward_pays_so_much_more_for_every_step_and_learns_the_same(normalised) -> None:
    """The first session comes before any training of the policy, so that it asks the same."""
    schedule = Schedule(sessions=1, segment_length=6, first_epochs=2)
    for method, members in (("polite", 1), ("polite", 3), ("untrained", 1)):
        how = {"normalise": normalised, "members": members, "schedule": schedule}
        plain, raised = (learned(method, reward_offset=offset, **how) for offset in (0.0, 1.5))
        for name, weights in plain.reward.named_parameters():
            assert torch.equal(weights, raised.reward.get_parameter(name))
        sizes = plain.reward.observation_size, plain.reward.action_size
        seen = [np.linspace(-1, 1, 3 * size).reshape(3, size) for size in sizes]
        more = predict(raised.reward, *seen) - predict(plain.reward, *seen)
        np.testing.assert_allclose(more, 1.5, rtol=1e-5)
        assert not np.array_equal(plain.policy.weights[0], raised.policy.weights[0])


# --- presets -------------------------------------------------------------------------------------


def test_presets_are_found_whatever_module_and_version() -> None:
    corridor = PRESETS["SocialCorridor"]
    assert preset_of("SocialCorridor-v0") is corridor
    assert preset_of("socialnav_env:SocialCorridor-v0") is corridor
    assert preset_of("Walker2d-v5") is PRESETS["Walker2d"]
    assert preset_of("Hopper-v5").oracle is None


@pytest.mark.parametrize("preset", PRESETS.values(), ids=PRESETS)
def test_oracle_and_reward_model_agree_on_the_length_of_a_highlight(preset) -> None:
    assert preset.oracle.length == preset.training.highlight_length


def test_the_corridor_oracle_marks_goals_and_collisions_but_not_driving() -> None:
    oracle = PRESETS["SocialCorridor"].oracle
    driving = np.full(50, 0.0156)  # .2 a metre at .083 m a step, less .001 for the effort
    rng = np.random.default_rng(0)
    for event, positive, negative in (
        (0.5, True, False),
        (1.0, True, False),
        (-1.0, False, True),
        (0.0, False, False),
    ):
        better = driving.copy()
        better[20] += event
        worse = np.full(50, -1.0)
        answer = replace(oracle, flip_probability=0.0).answer(0, better, worse, rng)
        assert (answer.positive is not None, answer.negative is not None) == (positive, negative)


@pytest.mark.parametrize("level", [-5.0, 5.0])
def test_other_envs_get_thresholds_from_their_own_rewards(level) -> None:
    """Also where no reward, or every one, is above 0."""
    rng = np.random.default_rng(0)
    pool = replace(make_pool(40), rewards=rng.normal(level, 0.5, (40, 5)))
    oracle = quantile_oracle(pool, length=3)
    answers = oracle.answer_queries(pool, uniform_pairs(100, rng, pool), rng)
    expressed = [answer for answer in answers if answer.preferred is not None]
    for sign in ("positive", "negative"):
        share = np.mean([getattr(answer, sign) is not None for answer in expressed])
        assert 0.1 < share < 0.9
    assert oracle.negative_threshold < level < oracle.positive_threshold
    assert oracle.tie_threshold == pytest.approx(0.01 * pool.returns.std())
