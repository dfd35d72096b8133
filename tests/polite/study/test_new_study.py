import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest
from made_up_study import answer, person

from polite.dataset import Feedback, load_feedback, save_feedback
from polite.experiments.new_study import folder as module
from polite.experiments.new_study.config import NewStudyConfig
from polite.experiments.new_study.folder import describe, new_study
from polite.experiments.new_study.pool import demo_folder
from polite.experiments.new_study.template import extreme_windows, fill_template, practice_pairs
from polite.policies.policy import GaussianPolicy, save_policy
from polite.study.assignment import sequence
from polite.study.clips import used_segments
from polite.study.design import parse_design, read_design
from polite.study.folder import StudyFolder
from polite.study.quality import FAILED_CATCH_PAIRS, SAME_CHOICE, exclusion
from polite.study.records import TrialRecord
from polite.types import InvalidValueError, PoliteError, Query, SegmentPool
from polite.video import write_video

SMALL = {"participants": 1, "comparisons": 2}


def pool_of(*rewards):
    """A pool whose segments have these rewards."""
    array = np.array(rewards, dtype=float)
    rows = np.zeros((*array.shape, 1))
    lengths = np.full(len(array), array.shape[1])
    return SegmentPool(rows, rows, array, rows, lengths, lengths, lengths)


def small_clips(monkeypatch):
    """Draw what the template asks for in few pixels."""
    look = lambda env: {"render_width": 96} if "Corridor" in env else {}  # noqa: E731
    monkeypatch.setattr("polite.experiments.new_study.template._look", look)


def test_the_demo_belongs_together() -> None:
    design, feedback = (
        read_design(demo_folder() / "study.toml"),
        load_feedback(demo_folder() / "pool"),
    )
    module.check_design(design, feedback)
    assert (design.participants, design.comparisons) == (4, 8)
    assert (design.repeated, design.mirrored, len(design.practice)) == (1, 1, 2)
    assert feedback.answers == []
    returns = feedback.pool.returns
    for pair in design.practice:  # what is expected is what the true reward says
        better, worse = (pair.first, pair.second)[:: 1 if pair.expected == "first" else -1]
        assert returns[better] > returns[worse]
    compared = {i for query in feedback.queries for i in (query.first, query.second)}
    assert not compared & design.segments  # nobody is taught on what they are asked
    size = sum(path.stat().st_size for path in demo_folder().rglob("*") if path.is_file())
    assert size < 1.5e6


def test_the_demo_s_examples_show_what_they_say() -> None:
    design, pool = (
        read_design(demo_folder() / "study.toml"),
        load_feedback(demo_folder() / "pool").pool,
    )
    for example, sign in ((design.guide.good, 1), (design.guide.bad, -1)):
        window = pool.rewards[example.segment][example.start :][: design.highlight_length + 1]
        assert sign * window.sum() > 0.4  # a goal, or a collision


def test_the_demo_is_one_command(tmp_path, monkeypatch, command_line) -> None:
    source = demo_folder()
    text = (source / "study.toml").read_text(encoding="utf-8")
    small = tmp_path / "demo"
    (small / "pool").mkdir(parents=True)
    for path in (source / "pool").iterdir():
        (small / "pool" / path.name).write_bytes(path.read_bytes())
    text = text.replace("render_width = 480", "render_width = 96")
    (small / "study.toml").write_text(text.replace("participants = 4", "participants = 1"), "utf-8")
    for name in ("folder", "pool"):
        monkeypatch.setattr(f"polite.experiments.new_study.{name}.demo_folder", lambda: small)
    out = tmp_path / "study"
    done = command_line("study", "new", out)
    assert done.returncode == 0, done.stderr
    assert f"polite serve {out}" in done.stdout.replace("\n", "")
    folder = StudyFolder(out)
    folder.check()
    assert (out / "secrets.json").exists()
    done = command_line("study", "new", out)
    assert (done.returncode, "--resume" in done.stderr) == (2, True)


def test_a_design_made_from_the_template_is_one(study_folder) -> None:
    text = fill_template(study_folder.feedback, None, 2, 3, 7)
    design = parse_design(text)
    module.check_design(design, study_folder.feedback)
    assert (design.participants, design.comparisons, design.seed) == (2, 3, 7)
    assert design.env == "socialnav_env:SocialCorridor-v0"
    assert design.env_settings == {"render_width": 480, "camera": "robot"}
    assert design.highlight_length == 2  # a fifth of 12 steps
    assert {q.name for q in design.questions} == {"age", "robots", "demanding", "comments"}
    assert "[INSTITUTION]" in design.consent.text
    assert "\\" not in design.consent.text


@pytest.mark.parametrize("comparisons", [3, 20])
def test_the_template_excludes_who_presses_one_side_only(study_folder, comparisons) -> None:
    design = parse_design(fill_template(study_folder.feedback, None, 1, comparisons, 0))
    for number in range(1, 11):
        trials = [
            TrialRecord(place, trial.kind, trial.query, trial.first_is_left)
            for place, trial in enumerate(sequence(design, number, 0))
        ]
        answers = [answer(trial.place) for trial in trials]
        someone = person(number, *answers, trials=tuple(trials))
        same = (SAME_CHOICE,) if comparisons >= 8 else ()  # three answers are too few for that rule
        assert exclusion(someone, design) == (FAILED_CATCH_PAIRS, *same)


def test_recorded_clips_and_strange_names_come_back_from_the_template(
    study_folder, tmp_path
) -> None:
    recorded = tmp_path / 'a "b" \\ ü'
    text = fill_template(study_folder.feedback, 'my"env:X-v0', 1, 2, 0, recorded)
    design = parse_design(text)
    assert design.env == 'my"env:X-v0'
    assert Path(design.recorded) == recorded
    assert design.env_settings == {}


def test_mujoco_is_drawn_in_fewer_pixels(study_folder) -> None:
    design = parse_design(fill_template(study_folder.feedback, "HalfCheetah-v5", 1, 2, 0))
    assert design.env_settings == {"width": 320, "height": 240}


def test_examples_are_the_best_and_the_worst_window() -> None:
    pool = pool_of([0, 0, 0, 0, 0], [0, 1, 2, 0, 9], [0, -3, -3, 9, 0], [0, 0, 0, -1, 0])
    good, bad = extreme_windows(pool, [0, 1, 2, 3], 1)
    assert (good.segment, good.start) == (1, 3)  # 0 + 9, the first one of two
    assert (bad.segment, bad.start) == (2, 1)
    good, bad = extreme_windows(pool, [2, 3], 1)
    assert (good.segment, bad.segment) == (2, 3)  # never the same
    with pytest.raises(PoliteError, match="two segments, found 1"):
        extreme_windows(pool, [2], 1)


def test_practice_pairs_differ_most() -> None:
    pool = pool_of([0], [1], [5], [-4], [2])
    assert practice_pairs(pool, [0, 1, 2, 3, 4], 2) == [(2, 3, "first"), (0, 4, "second")]
    assert practice_pairs(pool, [0, 1], 2) == [(1, 0, "first")]
    assert practice_pairs(pool_of([1], [1], [1]), [0, 1, 2], 2) == []


def test_a_pool_of_one_s_own(study_folder, tmp_path, monkeypatch) -> None:
    small_clips(monkeypatch)
    config = NewStudyConfig(folder=tmp_path / "new", pool=study_folder.pool_path, **SMALL)
    made = new_study(config)
    assert made.queries == study_folder.queries  # the pool's own pairs
    np.testing.assert_array_equal(made.pool.states, study_folder.pool.states)
    assert set(made.clips) == set(used_segments(made.design, made.feedback))
    assert "2 comparisons each" in describe(made)


def test_pairs_are_drawn_for_a_pool_without(study_folder, tmp_path, monkeypatch) -> None:
    small_clips(monkeypatch)
    source = tmp_path / "source"
    save_feedback(source, Feedback(study_folder.pool, []))
    made = new_study(NewStudyConfig(folder=tmp_path / "new", pool=source, **SMALL))
    assert len(made.queries) == 2
    again = new_study(NewStudyConfig(folder=tmp_path / "again", pool=source, **SMALL))
    assert made.queries == again.queries


@pytest.mark.parametrize("with_policy", [True, False])
def test_clips_are_collected_in_an_env(tmp_path, monkeypatch, with_policy) -> None:
    small_clips(monkeypatch)
    policy = tmp_path / "policy.pt"
    save_policy(
        policy,
        GaussianPolicy(
            weights=(np.zeros((2, 36), np.float32), np.array([1, 0], np.float32)),
            activation="tanh",
            log_std=np.full(2, -9, np.float32),
            mean=np.zeros(36),
            variance=np.ones(36),
            low=-np.ones(2, np.float32),
            high=np.ones(2, np.float32),
        ),
    )
    config = NewStudyConfig(
        folder=tmp_path / "new",
        env="SocialCorridor-v0",
        policy=policy if with_policy else None,
        segments=8,
        length=6,
        **SMALL,
    )
    made = new_study(config)
    assert made.pool.actions.shape == (8, 6, 2)
    straight = np.abs(made.pool.actions - [1, 0]).max() < 0.01
    assert straight == with_policy
    assert len(made.queries) == 2


def test_an_env_that_cannot_be_drawn_brings_recordings(tmp_path) -> None:
    source, recorded = tmp_path / "source", tmp_path / "recorded"
    recorded.mkdir()
    pool = pool_of(*np.random.default_rng(0).normal(size=(8, 6)))
    save_feedback(source, Feedback(pool, [Query(0, 1), Query(2, 1)]))
    for index in range(8):
        frames = np.full((6, 32, 32, 3), 20 * index, np.uint8)
        write_video(recorded / f"{index}.mp4", frames, 10)
    settings = {"pool": source, "env": "Nobody-v0", **SMALL}
    made = new_study(NewStudyConfig(folder=tmp_path / "new", recorded=recorded, **settings))
    assert {clip.steps for clip in made.clips.values()} == {6}
    with pytest.raises(PoliteError, match="cannot make 'Nobody-v0'"):
        new_study(NewStudyConfig(folder=tmp_path / "undrawn", **settings))
    assert not (tmp_path / "undrawn").exists()


@pytest.fixture
def config(study_folder, tmp_path):
    """A new study from the fixture's pool and its own design."""
    return NewStudyConfig(
        folder=tmp_path / "new",
        pool=study_folder.pool_path,
        config=study_folder.path / "study.toml",
    )


def resumed(config):
    return NewStudyConfig(folder=config.folder, resume=True)


def test_a_design_of_one_s_own_is_taken_as_it_is(study_folder, config) -> None:
    made = new_study(config)
    assert (made.path / "study.toml").read_bytes() == config.config.read_bytes()
    assert made.clips == study_folder.clips


@pytest.mark.parametrize("dies_in", ["claim_folder", "save_feedback", "write_atomically", "_draw"])
def test_a_killed_command_is_gone_on_with(study_folder, config, monkeypatch, dies_in) -> None:
    def die(*arguments, **keywords):
        raise KeyboardInterrupt

    with monkeypatch.context() as killing, pytest.raises(KeyboardInterrupt):
        killing.setattr(module, dies_in, die)
        new_study(config)
    again = config if dies_in == "claim_folder" else resumed(config)  # nothing to go on with yet
    made = new_study(again)
    assert made.clips == study_folder.clips
    assert made.queries == study_folder.queries


def test_resuming_keeps_what_the_researcher_edited(config) -> None:
    made = new_study(config)
    path = made.path / "study.toml"
    secrets = (made.path / "secrets.json").read_bytes()
    edited = path.read_text("utf-8").replace("render_width = 96", "render_width = 64")
    path.write_text(edited, "utf-8")
    with pytest.raises(PoliteError, match="shows something else"):
        StudyFolder(made.path).check()
    again = new_study(resumed(config))
    assert path.read_text("utf-8") == edited
    assert {clip.width for clip in again.clips.values()} == {64}
    assert (made.path / "secrets.json").read_bytes() == secrets


def test_another_study_is_not_gone_on_with(study_folder, config, tmp_path) -> None:
    new_study(config)
    other = NewStudyConfig(folder=config.folder, resume=True, seed=3)
    with pytest.raises(PoliteError, match="begun with seed = 0, not 3"):
        new_study(other)
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "thesis.tex").write_text("mine")
    with pytest.raises(PoliteError, match="holds no run to go on with"):
        new_study(NewStudyConfig(folder=tmp_path / "full", pool=study_folder.pool_path,
                                 config=config.config, resume=True))  # fmt: skip


@pytest.mark.parametrize(
    ("settings", "error", "message"),
    [
        ({"segments": 1}, InvalidValueError, "segments: expected at least 4, got 1"),
        ({"seed": -1}, InvalidValueError, "seed: expected at least 0"),
        ({"policy": Path("p.pt")}, PoliteError, "--policy acts in --env"),
        ({"recorded": Path("r")}, PoliteError, "give --pool as well"),
        ({"participants": 3}, PoliteError, "study.toml's to say"),
        ({"env": "Nope-v0", **SMALL}, PoliteError, "cannot make 'Nope-v0'"),
        ({"env": "CartPole-v1", **SMALL}, PoliteError, "continuous actions"),
        ({"env": "SocialCorridor-v0", "policy": Path("p.pt")}, PoliteError, "no such policy"),
        ({"pool": Path("nowhere")}, PoliteError, "manifest.json: missing"),
        ({"config": Path("nowhere.toml")}, PoliteError, "nowhere.toml: cannot be read"),
    ],
)
def test_a_mistake_leaves_no_folder(tmp_path, settings, error, message) -> None:
    with pytest.raises(error, match=message):
        new_study(NewStudyConfig(folder=tmp_path / "new", **settings))
    assert not (tmp_path / "new").exists()


def test_too_few_pairs_of_one_s_own(study_folder, tmp_path) -> None:
    config = NewStudyConfig(folder=tmp_path / "new", pool=study_folder.pool_path)
    with pytest.raises(PoliteError, match=r"expected 400 comparisons .* found 6"):
        new_study(config)


def test_without_the_extra_it_says_what_to_install(tmp_path, monkeypatch, command_line) -> None:
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    done = command_line("study", "new", tmp_path / "new")
    assert done.returncode == 2
    assert "pip install 'socialnav-polite[web]'" in done.stderr.replace("\n", " ")
    assert not (tmp_path / "new").exists()


def test_the_example_that_made_the_demo_chooses_clips_of_every_kind() -> None:
    path = Path(__file__).parents[3] / "examples" / "make_study_demo.py"
    spec = importlib.util.spec_from_file_location("make_study_demo", path)
    example = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(example)
    pool = load_feedback(demo_folder() / "pool").pool
    kinds = example.kinds_of(pool)
    counts = {name: int(is_kind.sum()) for name, is_kind in kinds.items()}
    assert counts == {name: count + 2 for name, count in example.KINDS.items()}
    assert (np.stack(list(kinds.values())).sum(axis=0) == 1).all()  # each of one kind
