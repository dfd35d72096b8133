import json
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from polite.analysis.offline import deciding_budget, rank, summarise_trials
from polite.analysis.quality import calibration_error
from polite.experiments.offline import bench as bench_module
from polite.experiments.offline.bench import BENCHES, compare
from polite.experiments.offline.candidates import BASELINE, CANDIDATES, LADDER, Candidate
from polite.experiments.offline.marks import around, hide_marked
from polite.experiments.offline.pools import load_pools
from polite.experiments.offline.trial import ask, run_trial, stack_answers
from polite.experiments.run_folder import sole_run
from polite.files import MARKER, marks
from polite.highlight_losses import HIGHLIGHT_LOSSES
from polite.methods.presets import preset_of
from polite.plots.offline import LADDER_LOOKS
from polite.report.offline import BENCH, report_bench, write_offline_report
from polite.samplers import uniform_pairs
from polite.types import Answer, Highlight, PoliteError, Query, SegmentPool

ENV = "Walker2d-v5"
TINY = replace(
    BENCHES["smoke"],
    pools=(replace(BENCHES["smoke"].pools[0], steps=2048, segments=40, held_out=20),),
    names=(BASELINE, "choice", "choice-two", "choice-ensemble"),
    budgets=(8,),
    seeds=2,
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A bench of a minimal size, run once."""
    out = tmp_path_factory.mktemp("bench") / "run"
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(BENCHES, "smoke", TINY)
        compare("smoke", 0, out, resume=False)
    return out


def make_pool(rewards):
    rewards = np.asarray(rewards, dtype=float)
    zeros = np.zeros((*rewards.shape, 1))
    count = len(rewards)
    return SegmentPool(
        observations=zeros,
        actions=zeros,
        rewards=rewards,
        states=zeros,
        lengths=np.full(count, rewards.shape[1]),
        trajectory=np.zeros(count),
        start=np.zeros(count),
    )


# --- the whole bench -----------------------------------------------------------------------------


def test_a_bench_leaves_its_numbers_tables_and_figures(folder) -> None:
    assert BENCH in marks(folder)
    for name in ("results.json", "report.html", "table.md", "figures/gains.png"):
        assert (folder / name).stat().st_size > 0
    table = (folder / "table.md").read_text("utf-8")
    assert all(f"| {name} |" in table for name in TINY.names)
    assert "simulated" in table and "simulated" in (folder / "report.html").read_text("utf-8")


@pytest.mark.parametrize(("key", "value"), [("candidates", 3), ("rows", [{}]), ("ranking", 0)])
def test_numbers_of_another_type_are_one_line_errors(folder, tmp_path, key, value) -> None:
    results = json.loads((folder / "results.json").read_text("utf-8"))
    broken = {k: v for k, v in results.items() if k != key}
    with pytest.raises(PoliteError, match=f"expected the key '{key}', found none; .*highlights"):
        write_offline_report(tmp_path, broken)
    with pytest.raises(PoliteError, match=r"results\.json: .*another version"):
        write_offline_report(tmp_path, broken | {key: value})
    assert not list(tmp_path.glob("*.*"))


def test_a_bench_goes_on_where_it_was_stopped(folder, monkeypatch) -> None:
    monkeypatch.setitem(BENCHES, "smoke", TINY)
    before = (folder / "results.json").read_bytes()
    (folder / "results.json").unlink()
    (folder / "stages" / f"trials-{ENV}-choice.json").unlink()
    compare("smoke", 0, folder, resume=True)
    assert (folder / "results.json").read_bytes() == before


def test_another_bench_is_not_gone_on_with(folder) -> None:
    with pytest.raises(PoliteError, match="other settings"):
        compare("smoke", 1, folder, resume=True)


def test_two_benches_do_not_work_in_one_folder(folder) -> None:
    run = json.loads((folder / MARKER).read_text("utf-8"))
    with sole_run(folder, run, True), pytest.raises(PoliteError, match="another run"):
        compare("smoke", run["seed"], folder, resume=True)


def test_a_report_is_drawn_again(folder) -> None:
    before = (folder / "report.html").read_bytes()
    (folder / "report.html").unlink()
    assert report_bench(folder).read_bytes() == before


# --- a trial -------------------------------------------------------------------------------------


def test_equal_seeds_equal_measures_other_seeds_others(folder) -> None:
    pools, preset = load_pools(folder, ENV), preset_of(ENV)
    trial = partial(run_trial, CANDIDATES["choice"], preset, pools, 8)
    assert trial(3) == trial(3)
    assert trial(3) != trial(4)


def test_candidates_of_a_seed_hear_the_same_preferences(folder) -> None:
    pool, preset = load_pools(folder, ENV)["asked"], preset_of(ENV)
    heard = []
    for name in (BASELINE, "choice", "choice-two", "choice-noisy", "choice-shuffled"):
        asked = uniform_pairs(12, np.random.default_rng(0), pool)
        used = replace(preset, marks_unusual=CANDIDATES[name].unusual)
        rngs = np.random.default_rng(1), np.random.default_rng(2)
        answers = ask(CANDIDATES[name], used, pool, asked, *rngs)
        heard.append([answer.preference for answer in answers[0]])
    assert all(preferences == heard[0] for preferences in heard)


def test_alone_means_that_nothing_is_learned_from_preferences(folder) -> None:
    pools, preset = load_pools(folder, ENV), preset_of(ENV)
    neither = Candidate("neither preferences nor highlights", None, alone=True)
    for candidate, learns in ((neither, False), (replace(neither, alone=False), True)):
        few, many = (
            run_trial(replace(candidate, epochs=epochs), preset, pools, 8, 3) for epochs in (1, 20)
        )
        assert (few != many) == learns


def test_a_second_mark_counts_without_a_second_preference(folder) -> None:
    pool, preset = load_pools(folder, ENV)["asked"], preset_of(ENV)
    asked = uniform_pairs(12, np.random.default_rng(0), pool)
    rngs = np.random.default_rng(1), np.random.default_rng(2)
    rounds = ask(CANDIDATES["choice-two"], replace(preset, marks_unusual=True), pool, asked, *rngs)
    data = stack_answers(pool, asked, rounds)
    assert len(data) == 24
    assert not data.mu[12:].any() and data.mu[:12].any()
    assert (data.positive[12:] >= 0).any()
    both = (data.positive[:12] >= 0) & (data.positive[12:] >= 0)
    assert (data.positive[:12] != data.positive[12:])[both].all()


def test_what_is_marked_is_hidden_with_all_windows_that_touch_it() -> None:
    pool = make_pool([[0, 0, 9, 0, 0, 0, 0, 3], [1] * 8])
    mark = Highlight(end=2, length=1)
    assert around(mark) == slice(1, 4)
    hidden = hide_marked(pool, [Query(1, 0)], [Answer(0, (0.0, 1.0), positive=mark)])
    assert hidden.rewards[0].tolist() == [0, 1.5, 1.5, 1.5, 0, 0, 0, 3]
    assert hidden.rewards[1].tolist() == [1] * 8
    assert pool.rewards[0, 2] == 9  # the pool itself is as it was


# --- the numbers ---------------------------------------------------------------------------------


def trials_of(gains, spread=0.01, accuracy=0.0):
    """Synthetic trials: rank correlation .5 plus a gain, pair accuracy .8 plus what is given."""
    rng = np.random.default_rng(0)
    trials = []
    for name, gain in gains.items():
        for seed in range(6):
            noise = rng.normal(0, spread)
            measures = {
                "pair_accuracy": 0.8 + (accuracy if gain else 0) + noise,
                "spearman": 0.5 + gain + noise,
                "pearson": 0.5,
                "saturation": None,
                "calibration_error": 0.1,
            }
            trials.append(
                {"env": "E", "candidate": name, "queries": 200, "seed": seed}
                | {"early": measures, "late": measures}
                | {"answers": {"positive": None if not gain else 0.5, "negative": 0.2}}
            )
    return trials


def test_differences_are_paired_and_ranked() -> None:
    gains = {"base": 0.0, "good": 0.2, "bad": -0.1, "much": 0.4}
    ranked = {"base": True, "good": True, "bad": True, "much": False}
    summary = summarise_trials(trials_of(gains), ranked)
    assert [entry["candidate"] for entry in summary["ranking"]] == ["good", "base", "bad"]
    row = next(row for row in summary["rows"] if row["candidate"] == "good")
    difference = row["late"]["spearman"]["difference"]
    assert difference["low"] < 0.2 < difference["high"]
    assert row["late"]["saturation"]["mean"] is None
    assert summary["rows"][0]["positive"] is None


def test_the_trials_order_does_not_matter() -> None:
    trials = trials_of({"base": 0.0, "good": 0.2})
    ranked = dict.fromkeys(("base", "good"), True)
    assert summarise_trials(trials[::-1], ranked) == summarise_trials(trials, ranked)


def test_what_has_no_number_comes_last() -> None:
    trials = trials_of({"base": 0.0, "broken": 0.3, "good": 0.2})
    ranked = dict.fromkeys(("base", "broken", "good"), True)
    one = next(trial for trial in trials if trial["candidate"] == "broken")
    one["late"] = one["late"] | {"spearman": None}
    ranking = summarise_trials(trials, ranked)["ranking"]
    assert [entry["candidate"] for entry in ranking] == ["good", "base", "broken"]
    one["late"] = one["late"] | {"pair_accuracy": None}
    assert not summarise_trials(trials, ranked)["ranking"][-1]["eligible"]


def test_trials_are_paired_by_their_seeds() -> None:
    trials = [t for t in trials_of({"base": 0.0, "good": 0.2}, spread=0.0)]
    fewer = [t for t in trials if not (t["candidate"] == "good" and t["seed"] != 3)]
    row = summarise_trials(fewer, dict.fromkeys(("base", "good"), True))["rows"][-1]
    assert row["late"]["spearman"]["difference"] == {
        "mean": pytest.approx(0.2),
        "low": None,
        "high": None,
    }


@pytest.mark.parametrize(
    ("budgets", "deciding"), [((50, 100, 800), 100), ((200, 800), 200), ((400, 300), 300)]
)
def test_candidates_are_ranked_at_one_budget(budgets: tuple[int, ...], deciding: int) -> None:
    assert deciding_budget([{"queries": budget} for budget in budgets]) == deciding


def test_who_loses_accuracy_comes_after_who_does_not() -> None:
    summary = summarise_trials(
        trials_of({"base": 0.0, "good": 0.2}, accuracy=-0.1), dict.fromkeys(("base", "good"), True)
    )
    assert [(e["candidate"], e["eligible"]) for e in summary["ranking"]] == [
        ("base", True),
        ("good", False),
    ]
    assert rank([], {}) == []


def test_calibration_by_hand() -> None:
    """Two bins: .9 predicted and 1 seen, .2 predicted and .5 seen."""
    probabilities, outcomes = np.array([0.9, 0.9, 0.2, 0.2]), np.array([1.0, 1.0, 1.0, 0.0])
    assert calibration_error(probabilities, outcomes) == pytest.approx((0.1 + 0.3) / 2)


@given(st.lists(st.sampled_from([0.0, 0.5, 1.0]), min_size=1), st.data())
def test_calibration_error_is_a_share(outcomes, data) -> None:
    size = {"min_size": len(outcomes), "max_size": len(outcomes)}
    predicted = np.array(data.draw(st.lists(st.floats(0, 1), **size)))
    error = calibration_error(predicted, np.array(outcomes))
    assert 0 <= error <= 1
    assert calibration_error(np.array(outcomes), np.array(outcomes)) == 0


# --- the candidates ------------------------------------------------------------------------------


def test_every_form_of_the_loss_is_a_candidate() -> None:
    assert {candidate.form for candidate in CANDIDATES.values()} == {None, *HIGHLIGHT_LOSSES}
    assert next(iter(CANDIDATES)) == BASELINE == LADDER[0]
    assert set(LADDER) <= set(CANDIDATES)
    assert set(LADDER_LOOKS) == set(LADDER)


def test_preferences_alone_leave_highlights_out() -> None:
    config = CANDIDATES[BASELINE].training(preset_of(ENV))
    assert (config.alpha_positive, config.alpha_negative) == (0.0, 0.0)


@pytest.mark.parametrize("name", [name for name in CANDIDATES if "few-epochs" in name])
def test_few_epochs_are_an_eighth_and_out_of_the_ranking(name: str) -> None:
    few, plain = CANDIDATES[name], CANDIDATES[name.replace("-few-epochs", "")]
    preset = preset_of(ENV)
    assert few.training(preset) == replace(plain.training(preset), epochs=12)
    assert not few.ranked and "12 epochs" in few.says
    assert replace(few, epochs=100, says=plain.says) == plain


@pytest.mark.parametrize("name", [name for name in CANDIDATES if "alone" in name])
def test_alone_is_the_form_itself_without_preferences(name: str) -> None:
    alone, both = CANDIDATES[name], CANDIDATES[name.replace("-alone", "")]
    assert alone == replace(both, alone=True, says=alone.says)
    assert "without preferences" in alone.says


def test_the_papers_candidate_has_the_papers_weights() -> None:
    config = CANDIDATES["paper"].training(preset_of(ENV))
    assert (config.highlights, config.alpha_positive, config.alpha_negative) == ("paper", 10.0, 5.0)
    assert bench_module.BENCHES["full"].budgets_of("paper") == (50, 100, 200, 262, 400, 800)
    assert bench_module.BENCHES["full"].budgets_of("margin") == (50, 200)
