import json
import re
from dataclasses import replace
from functools import partial

import gymnasium as gym
import numpy as np
import pytest
import torch
from PIL import Image
from stub_envs import TalkativeEnv, register

import polite
from polite.analysis.learning_curve import learning_curve
from polite.dataset import load_feedback
from polite.experiments.trained import read_trained
from polite.experiments.training import train as module
from polite.experiments.training.config import TrainConfig
from polite.experiments.training.held_out import held_out_quality
from polite.experiments.training.own_functions import as_function, checked, name_of
from polite.experiments.training.settings import pebble_settings
from polite.experiments.training.train import run_train, train
from polite.methods.config import METHODS
from polite.methods.pebble import learn_pebble
from polite.methods.pebble_config import PebbleConfig
from polite.methods.preference_learning import Learned
from polite.methods.presets import PRESETS, EnvPreset
from polite.policies.policy import load_policy
from polite.policies.ppo import PpoConfig
from polite.policies.vec_env import GymnasiumVecEnv, make_vec_env
from polite.rewards.ensemble import RewardEnsemble
from polite.rewards.files import load_reward_model
from polite.rewards.network import RewardNetConfig, predict, raise_by
from polite.teachers.oracle import Oracle
from polite.types import Answer, Highlight, InvalidValueError, PoliteError, Query

register()
TINY = PpoConfig(num_envs=2, rollout=32, batch_size=32, epochs=1, hidden=(8,))


@pytest.fixture(autouse=True)
def small_presets(monkeypatch) -> None:
    """The presets with a policy training that takes no time."""

    def tiny_preset_of(env_id: str) -> EnvPreset:
        name = env_id.rpartition(":")[2].rpartition("-v")[0]
        return replace(PRESETS.get(name, EnvPreset()), ppo=TINY)

    def tiny_pebble(config: TrainConfig, preset: EnvPreset) -> PebbleConfig:
        pebble = pebble_settings(config, preset)
        sac = replace(pebble.sac, hidden=(8,), batch_size=16)
        return replace(pebble, net=RewardNetConfig((8,), (0.0,)), sac=sac)

    monkeypatch.setattr(module, "held_out_quality", partial(held_out_quality, segments=20))
    monkeypatch.setattr(module, "preset_of", tiny_preset_of)
    monkeypatch.setattr(module, "pebble_settings", tiny_pebble)


def settings(folder, **changes):
    base = TrainConfig(
        out=folder / "run", env="Point-v0", queries=10, steps=128, evaluation_episodes=3
    )
    return replace(base, **changes)


def test_a_run_leaves_everything_that_it_promises(tmp_path) -> None:
    path = run_train(settings(tmp_path))
    assert path == tmp_path / "run" / "results.json"
    results = json.loads(path.read_text("utf-8"))
    assert results["config"]["method"] == "polite" and "out" not in results["config"]
    assert results["queries_asked"] == 10
    assert results["policy_steps"] == 128
    assert results["collection_steps"] > 0
    assert results["evaluation"]["episodes"] == 3
    assert results["evaluation"]["length"] == 20.0
    assert len(results["curve"]["steps"]) == len(results["curve"]["return"]) > 0
    assert len(load_feedback(path.parent / "data").answers) == 10
    assert load_reward_model(path.parent / "models" / "reward.pt").observation_size == 1
    assert load_policy(path.parent / "models" / "policy.pt").mean_action(np.zeros((1, 1))).size == 1
    with Image.open(path.parent / "figures" / "learning_curve.png") as picture:
        assert picture.width > 1000


@pytest.mark.parametrize("method", [*METHODS, "pebble", "polite-pebble", "sac"])
def test_every_method_runs(tmp_path, method) -> None:
    path = run_train(settings(tmp_path, method=method))
    results = json.loads(path.read_text("utf-8"))
    asks = method not in ("untrained", "ground-truth", "sac")
    assert results["queries_asked"] == (10 if asks else 0)
    assert (path.parent / "data").exists() == asks
    learns = method not in ("ground-truth", "sac")
    assert (path.parent / "models" / "reward.pt").exists() == learns
    quality = results["reward_quality"]
    assert sorted(quality or {}) == (["early"] if asks else []) + (["late"] if learns else [])
    for numbers in (quality or {}).values():
        assert 0 <= numbers["pair_accuracy"] <= 1


GIVEN = {"env": "Point-v0", "method": "given", "steps": 128, "evaluation_episodes": 3}


def finished(folder, **changes):
    """The reward model's file of a training in which it was never trained."""
    path = run_train(settings(folder, method="untrained", **changes))
    return path.parent / "models" / "reward.pt"


def paid(file):
    return predict(load_reward_model(file), np.ones((3, 1)), np.zeros((3, 1)))


def test_a_given_reward_model_pays_as_it_did_where_it_came_from(tmp_path) -> None:
    """The untrained model pays from the start too, so that it is the same training."""
    reward = finished(tmp_path / "a", members=2)
    path = train(out=str(tmp_path / "b"), reward=str(reward), **GIVEN)
    own, other = (
        load_policy(folder / "models" / "policy.pt") for folder in (reward.parents[1], path.parent)
    )
    np.testing.assert_equal(other.weights, own.weights)
    np.testing.assert_array_equal(paid(path.parent / "models" / "reward.pt"), paid(reward))
    results = json.loads(path.read_text("utf-8"))
    assert results["config"]["reward"].startswith("sha256:")
    assert results["simulated"] is None and results["queries_asked"] == 0
    assert (results["policy_steps"], results["collection_steps"]) == (128, 0)
    assert read_trained(path.parent).title == "Point-v0, given, seed 0"
    wished = train(out=tmp_path / "c", reward=finished(tmp_path / "d", seed=1), **GIVEN)
    weights = load_policy(wished.parent / "models" / "policy.pt").weights
    assert not np.array_equal(weights[0], own.weights[0])


@pytest.mark.parametrize("normalised", [False, True])
def test_a_given_reward_model_can_pay_more_for_every_step(tmp_path, normalised) -> None:
    pay = {"normalise": normalised, "reward_offset": 2.0}  # the given one's comes on top
    path = run_train(settings(tmp_path / "a", method="preferences", **pay))
    reward = path.parent / "models" / "reward.pt"
    path = train(out=tmp_path / "b", reward=reward, reward_offset=1.5, **GIVEN)
    more = paid(path.parent / "models" / "reward.pt") - paid(reward)
    np.testing.assert_allclose(more, 1.5, rtol=1e-5)


def test_saturation_is_of_what_is_trained_and_not_of_what_is_paid(tmp_path) -> None:
    reward = load_reward_model(finished(tmp_path))
    policy = load_policy(tmp_path / "run" / "models" / "policy.pt")
    learned = Learned(policy, reward, None, [], [], 0, 0)

    def late():
        return held_out_quality(partial(make_vec_env, "Point-v0"), learned, 0)["late"]

    before = late()
    raise_by(reward, 1.5)
    after = late()
    assert after["saturation"] == before["saturation"] < 1.0
    assert after["pair_accuracy"] == before["pair_accuracy"]
    with pytest.raises(InvalidValueError, match="reward_offset"):
        raise_by(reward, float("nan"))
    assert late() == after
    reward.config = replace(reward.config, output="linear")
    assert late()["saturation"] is None


def test_a_given_training_goes_on_with_the_same_model_wherever_it_lies(tmp_path) -> None:
    reward = finished(tmp_path / "a")
    path = train(out=tmp_path / "b", reward=reward, **GIVEN)
    moved = reward.rename(tmp_path / "moved.pt")
    assert train(out=tmp_path / "b", reward=moved, resume=True, **GIVEN) == path
    finished(tmp_path / "c", seed=1).replace(moved)
    with pytest.raises(PoliteError, match="other settings"):
        train(out=tmp_path / "b", reward=moved, resume=True, **GIVEN)


def test_a_reward_model_that_cannot_pay_is_refused_before_a_folder_is_made(tmp_path) -> None:
    reward = finished(tmp_path / "a")
    out = tmp_path / "b"
    with pytest.raises(PoliteError, match=r"trained on .*\(\(1,\), \(1,\)\), got an env with"):
        train(out=out, reward=reward, **(GIVEN | {"env": "Pendulum-v1"}))
    with pytest.raises(PoliteError, match="no such reward model"):
        train(out=out, reward="", **GIVEN)
    content = torch.load(reward, weights_only=True)
    content["state"]["level"] += np.nan
    torch.save(content, reward)
    with pytest.raises(PoliteError, match=f"{re.escape(str(reward))}.*NaN or infinity"):
        train(out=out, reward=reward, **GIVEN)
    assert not out.exists()


class LastStep:
    """Likes the segment whose last observation is larger, and marks its end."""

    def __init__(self) -> None:
        self.asked = 0

    def __call__(self, pool, queries, rng):
        self.asked += len(queries)
        ends = [[pool[s].observations[-1, 0] for s in (q.first, q.second)] for q in queries]
        return [
            Answer(number, (1.0, 0.0) if first > second else (0.0, 1.0), Highlight(3, 3))
            for number, (first, second) in enumerate(ends)
        ]


@pytest.mark.parametrize("method", ["polite", "preferences", "polite-pebble"])
def test_a_teacher_of_one_s_own_answers(tmp_path, method) -> None:
    out, teacher = str(tmp_path / "run"), LastStep()
    given = {"env": "Point-v0", "queries": 10, "steps": 128, "evaluation_episodes": 3}
    if method != "preferences":  # which has no use for it
        given["highlight_length"] = 3
    path = train(out=out, method=method, teacher=teacher, **given)
    results = json.loads(path.read_text("utf-8"))
    assert teacher.asked == results["queries_asked"] == 10
    assert results["config"]["teacher"] == f"{__name__}.LastStep"
    assert results["simulated"] is None
    answers = load_feedback(path.parent / "data").answers
    assert {answer.positive for answer in answers} == {Highlight(3, 3)}
    with pytest.raises(PoliteError, match="other settings"):
        train(out=out, method=method, resume=True, **given)


def extremes(request, model):
    """The segments that the model pays most and least."""
    pool = request.pool
    paid = predict(model, pool.observations, pool.actions) * pool.mask  # without the padding
    order = np.argsort(paid.sum(axis=1))
    return [Query(order[-1 - k], order[k]) for k in range(request.count)]


POINT = {"env": "Point-v0", "queries": 10, "steps": 128, "evaluation_episodes": 3}


def test_a_sampler_of_one_s_own_chooses_from_the_second_session_on(tmp_path) -> None:
    asked = []

    def noted(request, model):
        asked.append((request, extremes(request, model)))
        return asked[-1][1]

    path = train(out=tmp_path / "run", sampler=noted, sessions=2, **POINT)
    config = json.loads(path.read_text("utf-8"))["config"]
    assert config["sampler"] == f"{__name__}.{noted.__qualname__}"
    ((request, pairs),) = asked
    assert request.count == len(pairs) == 5
    feedback = load_feedback(path.parent / "data")
    assert feedback.queries[5:] == pairs
    assert max(max(q.first, q.second) for q in feedback.queries[:5]) < 25  # before they were there
    with pytest.raises(PoliteError, match="other settings"):
        train(out=tmp_path / "run", sampler=extremes, sessions=2, resume=True, **POINT)


@pytest.mark.parametrize(
    "pairs",
    [None, 5, [], [(0, 1)] * 5, [Query(0, 1)] * 4, [Query(0, 10**6)] * 5, [Query(0, 1)] * 6],
)
def test_what_is_no_choice_of_pairs_is_refused(tmp_path, pairs) -> None:
    with pytest.raises(InvalidValueError, match="sampler: expected 5 Queries of segments 0 to"):
        train(out=tmp_path / "run", sampler=lambda request, model: pairs, sessions=2, **POINT)


@pytest.mark.parametrize(
    "change",
    [
        {"method": "pebble"},
        {"method": "ground-truth"},
        {"schedule": "up-front"},
        {"sampler": 3},
        {"sampler": None},
        {"sessions": 1},
        {"queries": 1},
    ],
)
def test_a_sampler_that_nobody_would_ask_is_refused(tmp_path, change) -> None:
    with pytest.raises(InvalidValueError, match="sampler: "):
        train(out=tmp_path / "run", **(POINT | {"sampler": extremes} | change))
    assert not (tmp_path / "run").exists()


def test_a_sampler_may_be_an_object_that_is_empty(tmp_path) -> None:
    class Recorder(list):
        def __call__(self, request, model):
            self.append(request)
            return extremes(request, model)

    recorder = Recorder()
    train(out=tmp_path / "run", sampler=recorder, sessions=3, **POINT)
    assert len(recorder) == 2


@pytest.mark.parametrize(
    ("method", "answer", "told"),
    [
        ("highlights", Answer(0, (1.0, 0.0)), True),
        ("preferences", Answer(0, (0.0, 0.0)), True),
        ("polite", Answer(0, (0.0, 0.0)), True),
        ("polite", Answer(0, (1.0, 0.0)), False),
        ("preferences", Answer(0, (0.5, 0.5)), False),
        ("pebble", Answer(0, (0.0, 0.0)), True),
        ("pebble", Answer(0, (0.5, 0.5)), False),
        ("highlights", Answer(0, (1.0, 0.0), Highlight(9, 3)), False),
    ],
)
def test_answers_that_teach_nothing_are_told(tmp_path, capsys, method, answer, told) -> None:
    train(
        out=tmp_path / "run",
        method=method,
        teacher=lambda pool, queries, rng: [replace(answer, query=k) for k in range(len(queries))],
        **({"highlight_length": 3} if method in ("polite", "highlights") else {}),
        **POINT,
    )
    assert (f"anything that {method} learns from" in capsys.readouterr().err) == told


def test_a_training_says_how_it_went(tmp_path, capsys) -> None:
    path = run_train(settings(tmp_path))
    results = json.loads(path.read_text("utf-8"))
    share = results["reward_quality"]["late"]["pair_accuracy"]
    judged = f"true return {results['evaluation']['return']:,.2f} over 3 episodes"
    assert f"{judged}; r̂ puts {share:.0%} of fresh pairs" in capsys.readouterr().err
    run_train(settings(tmp_path, out=tmp_path / "ceiling", method="ground-truth"))
    told = capsys.readouterr().err
    assert "over 3 episodes" in told and "r̂" not in told and "reward model" not in told


@pytest.mark.parametrize("content", ["{", "[]", ""])
def test_damaged_results_are_made_again_when_they_are_deleted(tmp_path, content) -> None:
    path = run_train(settings(tmp_path))
    before = path.read_bytes()
    path.write_text(content, encoding="utf-8")
    with pytest.raises(PoliteError, match=r"results\.json: .*delete it, and --resume"):
        run_train(settings(tmp_path, resume=True))
    path.unlink()
    assert run_train(settings(tmp_path, resume=True)).read_bytes() == before


def test_a_setting_of_the_env_that_json_cannot_hold_is_named(tmp_path) -> None:
    with pytest.raises(InvalidValueError, match=r"env_settings: .*gravity = <function"):
        train(out=tmp_path / "run", env="Point-v0", env_settings={"gravity": settings})
    assert not (tmp_path / "run").exists()


def test_a_setting_of_the_env_may_be_numpy_s(tmp_path) -> None:
    train(
        out=tmp_path / "run", env="Short-v0", env_settings={"spoiled_at": np.int64(-1)},
        method="untrained", steps=64, evaluation_episodes=1,
    )  # fmt: skip


class Leaves(LastStep):
    """The same, who tosses coins too, and leaves once it has answered so many."""

    def __init__(self, answered: int) -> None:
        super().__init__()
        self.leaves_at = answered

    def __call__(self, pool, queries, rng):
        if self.asked >= self.leaves_at:
            self.leaves_at = 1000
            raise KeyboardInterrupt
        rng.random(3)
        return super().__call__(pool, queries, rng)


@pytest.mark.parametrize("method", ["polite", "polite-pebble"])
def test_a_teacher_who_left_is_not_asked_again(tmp_path, method) -> None:
    given = {
        "env": "Point-v0", "queries": 10, "steps": 128, "evaluation_episodes": 2,
        "highlight_length": 3, "sessions": 3, "method": method,
    }  # fmt: skip
    leaves = Leaves(6)
    stays = train(out=tmp_path / "whole", teacher=Leaves(1000), **given)
    with pytest.raises(KeyboardInterrupt):
        train(out=tmp_path / "left", teacher=leaves, **given)
    path = train(out=tmp_path / "left", teacher=leaves, resume=True, **given)
    assert leaves.asked == 10
    assert path.read_bytes() == stays.read_bytes()
    answers = [load_feedback(where.parent / "data").answers for where in (path, stays)]
    assert answers[0] == answers[1]
    assert sorted(p.name for p in (path.parent / "data").iterdir()) == sorted(
        p.name for p in (stays.parent / "data").iterdir()
    )
    assert not (path.parent / "data" / "sessions").exists()


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"method": "ground-truth"}, r"teacher: ground-truth asks nobody; .*LastStep"),
        ({"marks": "true-winner"}, r"marks: for simulated teachers only; .*LastStep"),
        ({"highlights_missed": 0.5}, "highlights_missed: for simulated teachers only"),
    ],
)
def test_what_a_teacher_of_one_s_own_would_not_hear_is_refused(tmp_path, change, says) -> None:
    with pytest.raises(PoliteError, match=says):
        run_train(settings(tmp_path, **change), LastStep())
    assert not (tmp_path / "run").exists()


def test_a_teacher_may_be_an_object_and_goes_by_its_name(tmp_path) -> None:
    oracle = replace(Oracle(), length=PRESETS["Walker2d"].training.highlight_length)
    assert as_function(oracle) == oracle.answer_queries
    assert name_of(oracle.answer_queries) == "polite.teachers.oracle.Oracle.answer_queries"
    assert name_of(partial(partial(as_function, 1))).endswith("own_functions.as_function")
    with pytest.raises(PoliteError, match=r"teacher: expected a name, a function .*got 7"):
        train(out=tmp_path / "run", teacher=7)
    with pytest.raises(PoliteError, match=r"teacher: expected one of polite, oracle.*got 'nobody'"):
        train(out=tmp_path / "run", teacher="nobody")


@pytest.mark.parametrize(
    "answers",
    [None, [], [Answer(0, (1.0, 0.0))], [Answer(1, (1.0, 0.0)), Answer(0, (1.0, 0.0))], [1, 2]],
)
def test_answers_that_are_not_to_the_queries_are_refused(answers) -> None:
    teacher = checked(lambda pool, queries, rng: answers, 3)
    with pytest.raises(PoliteError, match="teacher: expected 2 Answers, one to each query"):
        teacher(None, [Query(0, 1), Query(1, 2)], None)


def test_highlights_of_another_length_than_the_loss_reads_are_refused() -> None:
    marked = [Answer(0, (1.0, 0.0), negative=Highlight(9, 4))]
    with pytest.raises(PoliteError, match=r"expected highlights of length 3.*length=4"):
        checked(lambda pool, queries, rng: marked, 3)(None, [Query(0, 1)], None)
    assert checked(lambda pool, queries, rng: marked, 4)(None, [Query(0, 1)], None) == marked


def test_in_a_log_file_every_tenth_of_the_way_is_a_line(tmp_path, capsys) -> None:
    run_train(settings(tmp_path, steps=640))
    lines = [line for line in capsys.readouterr().err.splitlines() if re.match(r" *\d+% \w", line)]
    shares = [int(line.split("%")[0]) for line in lines]
    assert shares == sorted(set(shares)) and len(shares) > 8 and shares[-1] == 100
    assert any("true return lately" in line for line in lines)


def test_a_stopped_pebble_goes_on_from_its_last_session(tmp_path, monkeypatch) -> None:
    whole = run_train(settings(tmp_path, method="pebble"))
    assert not (whole.parent / module.CHECKPOINT).exists()

    def stopping(*args, **kwargs):
        def report(says, share):
            if share > 0.7:
                raise KeyboardInterrupt

        *rest, _, checkpoint, follow = args
        return learn_pebble(*rest, report, checkpoint, follow, **kwargs)

    again = settings(tmp_path, method="pebble", out=tmp_path / "again")
    with monkeypatch.context() as patch:
        patch.setattr(module, "learn_pebble", stopping)
        with pytest.raises(KeyboardInterrupt):
            run_train(again)
    assert (again.out / module.CHECKPOINT).exists()
    assert run_train(replace(again, resume=True)).read_bytes() == whole.read_bytes()


def test_the_corridor_tells_success_and_is_run_at_a_fixed_horizon(tmp_path) -> None:
    path = run_train(settings(tmp_path, env="SocialCorridor-v0", method="ground-truth", steps=1280))
    evaluation = json.loads(path.read_text("utf-8"))["evaluation"]
    assert evaluation["length"] == 600.0  # no collision or goal ends an episode
    for rate in ("success_rate", "collision_rate", "intermittent_rate"):
        assert 0.0 <= evaluation[rate] <= 1.0


@pytest.mark.parametrize("method", ["polite", "ground-truth"])
def test_episodes_may_end_early_and_after_a_single_step(tmp_path, method: str) -> None:
    path = run_train(settings(tmp_path, env="Short-v0", method=method))
    evaluation = json.loads(path.read_text("utf-8"))["evaluation"]
    assert evaluation["length"] == 1.0  # of the first episode
    if method == "polite":
        pool = load_feedback(path.parent / "data").pool
        assert pool.lengths.max() <= 7 and 1 in pool.lengths
        for segment in map(pool.__getitem__, range(len(pool))):  # (step, episode): no reset within
            steps, episodes = segment.observations.T
            assert (np.diff(steps) == 1).all() and (np.diff(episodes) == 0).all()


def test_walkers_that_fall_are_learned_from(tmp_path) -> None:
    path = run_train(settings(tmp_path, env="Walker2d-v5", queries=5))
    results = json.loads(path.read_text("utf-8"))
    assert results["queries_asked"] == 5
    pool = load_feedback(path.parent / "data").pool
    assert pool.observations.shape[1:] == (50, 17) and pool.lengths.min() < 50


def test_actions_may_have_any_bounds(tmp_path) -> None:
    path = run_train(settings(tmp_path, env="WidePoint-v0"))
    pool = load_feedback(path.parent / "data").pool
    actions = pool.actions[pool.mask]
    assert -3.0 <= actions.min() < -1.0 and 1.0 < actions.max() <= 5.0
    policy = load_policy(path.parent / "models" / "policy.pt")
    assert (policy.low, policy.high) == ([-3.0], [5.0])


def test_a_run_with_everything_else_than_usual(tmp_path) -> None:
    changes = {
        "teacher": "equal",
        "schedule": "decaying",
        "sampler": "disputed-k-centre",
        "members": 2,
        "reward_net": [8, 4],
        "learning_rate": 1e-3,
        "segment_length": 8,
        "show_ends": True,
        "loss": "released",
        "highlights": "choice",
        "highlight_length": 3,
        "highlight_decay": 0.9,
        "marks": "true-winner",
        "highlights_missed": 0.1,
        "highlights_wrong_sign": 0.1,
        "highlights_shifted": 0.1,
    }
    path = run_train(settings(tmp_path, **changes))
    results = json.loads(path.read_text("utf-8"))
    assert {name: results["config"][name] for name in changes} == changes
    assert results["queries_asked"] == 10 and len(results["sessions"]) > 1
    model = load_reward_model(path.parent / "models" / "reward.pt")
    assert isinstance(model, RewardEnsemble) and len(model) == 2
    assert model.config.hidden == (8, 4)
    feedback = load_feedback(path.parent / "data")
    assert feedback.pool.rewards.shape[1] == 8
    highlights = [a.positive for a in feedback.answers if a.positive]
    assert {highlight.length for highlight in highlights} <= {3}


def test_from_python_keywords_are_enough(tmp_path) -> None:
    path = polite.train(
        out=str(tmp_path / "run"), env="Point-v0", queries=4, steps=64, evaluation_episodes=2
    )
    assert path.is_file()
    with pytest.raises(TypeError, match="colour"):
        train(out=tmp_path / "other", colour="red")


def test_from_python_numbers_may_be_numpy_s_and_env_settings_a_dict(tmp_path) -> None:
    given = {"queries": np.int64(4), "steps": np.int32(64), "validation_share": np.float32(0.25)}
    path = polite.train(
        out=tmp_path / "run",
        env="Point-v0",
        env_settings={"max_episode_steps": 7},
        evaluation_episodes=2,
        reward_net=np.array([8, 4]),
        **given,
    )
    config = json.loads(path.read_text("utf-8"))["config"]
    assert config["reward_net"] == [8, 4]
    assert config["env_settings"] == {"max_episode_steps": 7}
    assert {name: config[name] for name in given} == given


def test_a_teacher_of_one_s_own_may_count_with_numpy(tmp_path) -> None:
    def teacher(pool, queries, rng):
        best = [np.argmax(pool[query.first].rewards) for query in queries]
        first = np.array([1, 0], dtype=np.float32)
        return [
            Answer(number, first, Highlight(end, np.int32(3)))
            for number, end in zip(np.arange(len(queries)), best, strict=True)
        ]

    out = tmp_path / "run"
    train(
        out=out, env="Point-v0", teacher=teacher, queries=4, steps=64, evaluation_episodes=2,
        highlight_length=3,
    )  # fmt: skip
    answers = load_feedback(out / "data").answers
    assert [answer.preference for answer in answers] == [(1.0, 0.0)] * 4


@pytest.mark.parametrize(("teacher", "told"), [("skip", True), ("oracle", False)])
def test_a_teacher_whose_threshold_does_nothing_is_told(tmp_path, capsys, teacher, told) -> None:
    # Pendulum-v1 pays less than 0 for every step.
    run_train(settings(tmp_path, env="Pendulum-v1", teacher=teacher, steps=256))
    assert ("average_return" in capsys.readouterr().err) == told


def test_equal_seeds_give_equal_results(tmp_path) -> None:
    first, second = (
        run_train(settings(tmp_path, out=tmp_path / name)).read_bytes() for name in ("a", "b")
    )
    assert first == second
    for model in ("reward.pt", "policy.pt"):
        first, second = ((tmp_path / name / "models" / model).read_bytes() for name in ("a", "b"))
        assert first == second


def test_every_env_that_is_made_is_closed(tmp_path, monkeypatch) -> None:
    opened, closed = set(), set()
    make, close = module.make_vec_env, GymnasiumVecEnv.close

    def make_and_note(*arguments, **settings):
        env = make(*arguments, **settings)
        opened.add(env)
        return env

    monkeypatch.setattr(module, "make_vec_env", make_and_note)
    monkeypatch.setattr(GymnasiumVecEnv, "close", lambda env: (closed.add(env), close(env)))
    run_train(settings(tmp_path))
    assert len(opened) >= 3  # probe, training, judging
    assert closed == opened


# --- the folder ----------------------------------------------------------------------------------


def test_a_folder_in_use_is_left_alone(tmp_path) -> None:
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "thesis.txt").write_text("mine")
    with pytest.raises(PoliteError, match="not empty") as caught:
        run_train(settings(tmp_path))
    assert "\n" not in str(caught.value)
    assert [p.name for p in (tmp_path / "run").iterdir()] == ["thesis.txt"]


def test_a_finished_run_is_not_repeated(tmp_path, capsys) -> None:
    path = run_train(settings(tmp_path))
    before = path.stat().st_mtime_ns
    assert run_train(settings(tmp_path, resume=True)) == path
    assert path.stat().st_mtime_ns == before
    assert "finished already" in " ".join(capsys.readouterr().err.split())


def test_an_unfinished_run_starts_over_in_its_folder(tmp_path) -> None:
    path = run_train(settings(tmp_path))
    finished = path.read_bytes()
    path.unlink()
    (path.parent / "models" / "policy.pt").write_bytes(b"cut sho")
    assert run_train(settings(tmp_path, resume=True)).read_bytes() == finished
    load_policy(path.parent / "models" / "policy.pt")


def test_what_was_learned_is_kept_whatever_goes_wrong_after_it(tmp_path, monkeypatch) -> None:
    def fail(*arguments):
        raise RuntimeError("while judging")

    monkeypatch.setattr(module, "judge", fail)
    with pytest.raises(RuntimeError, match="judging"):
        run_train(settings(tmp_path))
    kept = tmp_path / "run"
    assert len(load_feedback(kept / "data").answers) == 10
    assert load_policy(kept / "models" / "policy.pt").mean_action(np.zeros((1, 1))).size == 1
    assert not (kept / "results.json").exists()


def test_keywords_of_the_env_reach_it_and_their_order_is_no_setting(tmp_path) -> None:
    asked = ("max_episode_steps=9", "disable_env_checker=true")
    config = settings(tmp_path, env="Endless-v0", env_settings=asked)
    results = json.loads(run_train(config).read_text("utf-8"))
    assert results["evaluation"]["length"] == 9
    again = replace(config, env_settings=asked[::-1], resume=True)
    assert json.loads(run_train(again).read_text("utf-8")) == results


def test_what_an_env_tells_only_where_it_happens_has_not_happened_elsewhere(
    tmp_path, monkeypatch
) -> None:
    tell = TalkativeEnv.step

    def step(self, action):
        *step, _ = tell(self, action)
        return *step, {} if self.episode % 2 else {"success": True}

    monkeypatch.setattr(TalkativeEnv, "step", step)
    results = json.loads(run_train(settings(tmp_path, env="Talkative-v0")).read_text("utf-8"))
    assert results["evaluation"]["success_rate"] == 1.0  # a first episode in each env
    assert np.mean(results["curve"]["success_rate"]) == pytest.approx(0.5, abs=0.1)


def test_two_cannot_train_in_one_folder(tmp_path, monkeypatch) -> None:
    def second(*arguments):
        with pytest.raises(PoliteError, match="another run"):
            run_train(settings(tmp_path, resume=True))
        return judge(*arguments)

    judge = module.judge
    monkeypatch.setattr(module, "judge", second)
    run_train(settings(tmp_path))


def test_another_run_cannot_be_resumed(tmp_path) -> None:
    run_train(settings(tmp_path))
    with pytest.raises(PoliteError, match="other settings"):
        run_train(settings(tmp_path, resume=True, seed=1))


# --- mistakes ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"env": "NoSuchEnv-v0"}, "NoSuchEnv"),
        ({"env": "CartPole-v1"}, "continuous"),
        ({"env": "Endless-v0"}, "time limit"),
        ({"env": "DescribedPoint-v0"}, "vectors"),
        ({"env": "BoundlessPoint-v0"}, "bounds"),
        ({"env": "StepwisePoint-v0"}, "continuous actions"),
        ({"env": "CodedPoint-v0"}, "vectors"),
        ({"env": "CodedPoint-v0", "method": "pebble"}, "vectors"),
        ({"env": "BoundlessPoint-v0", "method": "pebble"}, "bounds"),
        ({"env_settings": ("no_such_keyword=1",)}, "no_such_keyword"),
        ({"env_settings": ("count=1",)}, "count"),
        ({"env_settings": ("max_episode_steps=-1",)}, "time limit"),
        ({"env": "HalfCheetah-v5", "env_settings": ('xml_file="/nowhere.xml"',)}, "nowhere"),
    ],
)
def test_an_env_that_cannot_be_used_leaves_no_folder(tmp_path, change, says: str) -> None:
    with pytest.raises(PoliteError, match=says) as caught:
        run_train(settings(tmp_path, **change))
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    "change", [{"queries": -1}, {"steps": 0}, {"seed": -1}, {"evaluation_episodes": 0}]
)
def test_impossible_numbers_are_refused(tmp_path, change) -> None:
    with pytest.raises(PoliteError, match=next(iter(change))):
        settings(tmp_path, **change)


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({"steps": "64"}, "a whole number"),
        ({"members": 2.0}, "a whole number"),
        ({"validation_share": "half"}, "a number"),
        ({"env": gym.make("Pendulum-v1")}, "a text"),
    ],
)
def test_values_of_another_type_are_refused(tmp_path, change, expected) -> None:
    with pytest.raises(PoliteError, match=f"{next(iter(change))}: expected {expected}"):
        settings(tmp_path, **change)


def test_asking_nothing_is_refused_where_answers_are_needed(tmp_path) -> None:
    with pytest.raises(PoliteError, match="queries"):
        run_train(settings(tmp_path, queries=0))


# --- the learning curve --------------------------------------------------------------------------


def test_a_point_is_the_mean_of_the_episodes_that_ended_in_its_stretch() -> None:
    ends = ((1, 2.0), (10, 4.0), (11, 7.0), (40, 1.0))
    episodes = [{"step": step, "return": value} for step, value in ends]
    assert learning_curve(episodes, steps=40, points=4) == {
        "steps": [10.0, 20.0, 40.0],
        "episodes": [2, 1, 1],
        "return": [3.0, 7.0, 1.0],
    }


def test_what_only_some_episodes_tell_has_no_curve() -> None:
    rare = {"step": 2, "return": 1.0, "success_rate": 1.0}
    for episodes in ([{"step": 1, "return": 3.0}, rare], [rare, {"step": 4, "return": 3.0}]):
        assert learning_curve(episodes, steps=4, points=1) == {
            "steps": [4.0],
            "episodes": [2],
            "return": [2.0],
        }


def test_no_episodes_no_points() -> None:
    assert learning_curve([], 100) == {"steps": [], "episodes": []}
