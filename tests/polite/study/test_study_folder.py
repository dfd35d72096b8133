import json
import stat
import sys

import numpy as np
import pytest

from polite.dataset import DatasetError, Feedback, load_feedback, save_feedback
from polite.study.clips import ClipError, clip_files
from polite.study.design import DesignError, parse_design
from polite.study.folder import Secrets, StudyFolder, StudyFolderError
from polite.types import PoliteError, SegmentPool


def edit(study_folder, *changes):
    """The folder, read anew after texts of its design have been exchanged."""
    path = study_folder.path / "study.toml"
    text = path.read_text(encoding="utf-8")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path.write_text(text, encoding="utf-8")
    return StudyFolder(study_folder.path)


def refused(folder, error, message):
    with pytest.raises(error, match=message):
        folder.check()


def test_a_finished_study_belongs_together(study_folder) -> None:
    study_folder.check()
    assert study_folder.design == parse_design(
        (study_folder.path / "study.toml").read_text("utf-8")
    )
    assert len(study_folder.pool) == 6
    assert study_folder.queries == load_feedback(study_folder.pool_path).queries
    assert study_folder.database_path.parent == study_folder.path


def test_secrets_are_made_once_and_for_the_owner_only(study_folder) -> None:
    path = study_folder.path / "secrets.json"
    path.unlink()
    made = StudyFolder(study_folder.path).secrets
    assert StudyFolder(study_folder.path).secrets == made
    assert len({made.session_key, made.researcher_token}) == 2
    assert min(len(made.session_key), len(made.researcher_token)) >= 43  # 32 bytes in base 64
    assert made.session_key not in repr(made)
    assert made.researcher_token not in repr(made)
    if sys.platform != "win32":
        assert stat.S_IMODE(path.stat().st_mode) == 0o600


def test_no_two_studies_have_the_same_secrets(tmp_path) -> None:
    drawn = [StudyFolder(tmp_path / name).secrets for name in ("a", "b")]
    assert drawn[0].session_key != drawn[1].session_key
    assert drawn[0].researcher_token != drawn[1].researcher_token


@pytest.mark.parametrize(
    "content", ["", "[]", "{}", '{"session_key": "short", "researcher_token": "short"}']
)
def test_damaged_secrets_are_refused_and_kept(study_folder, content) -> None:
    path = study_folder.path / "secrets.json"
    path.write_text(content)
    with pytest.raises(PoliteError, match="restore it"):
        _ = study_folder.secrets
    assert path.read_text() == content


def test_secrets_compare_by_value() -> None:
    assert Secrets("a", "b") == Secrets("a", "b") != Secrets("a", "c")


def test_a_folder_that_is_not_there(tmp_path) -> None:
    refused(StudyFolder(tmp_path / "no"), StudyFolderError, "make one with: polite study new")


def test_a_design_that_is_not_there(study_folder) -> None:
    (study_folder.path / "study.toml").unlink()
    refused(study_folder, DesignError, "study.toml: cannot be read")


def test_a_pool_that_was_altered(study_folder) -> None:
    (study_folder.pool_path / "queries.json").write_text("[[0, 1]]")
    refused(study_folder, DatasetError, "queries.json: cut short or altered")


def test_too_few_comparisons(study_folder) -> None:
    more = edit(study_folder, ("participants = 2", "participants = 3"))
    refused(more, StudyFolderError, r"expected 9 comparisons \(3 participants x 3\), found 6")


def test_an_example_beyond_the_pool(study_folder) -> None:
    beyond = edit(study_folder, ("good = { segment = 0", "good = { segment = 6"))
    refused(beyond, StudyFolderError, "expected segments below 6, the size of the pool, got 6")


def test_a_window_must_lie_within_its_clip(study_folder) -> None:
    edit(study_folder, ("start = 5", "start = 8")).check()  # steps 8 to 11 of 12
    late = edit(study_folder, ("start = 8", "start = 9"))
    refused(late, StudyFolderError, r"guide.bad.start: expected at most 8.*segment 1, got 9")


def test_a_window_longer_than_its_clip_begins_at_its_first_step(study_folder) -> None:
    long = edit(study_folder, ("highlight_length = 3", "highlight_length = 30"),
                ("start = 2", "start = 0"))  # fmt: skip
    refused(long, StudyFolderError, "guide.bad.start: expected at most 0")
    edit(study_folder, ("start = 5", "start = 0")).check()


def test_practice_compares_two_segments(study_folder) -> None:
    same = edit(study_folder, ("second = 1", "second = 0"))
    refused(same, StudyFolderError, "practice 1: expected two different segments, got 0 twice")


def test_a_clip_that_is_not_listed(study_folder) -> None:
    path = study_folder.path / "clips" / "clips.json"
    content = json.loads(path.read_text())
    del content["1"]
    path.write_text(json.dumps(content))
    refused(study_folder, StudyFolderError, "the first that of segment 1; make the clips again")


def test_no_list_of_clips(study_folder) -> None:
    (study_folder.path / "clips" / "clips.json").unlink()
    refused(study_folder, ClipError, "clips.json: cannot be read")


@pytest.mark.parametrize("which", [0, 1])
def test_a_clip_that_is_missing(study_folder, which) -> None:
    path = clip_files(study_folder.path, study_folder.clips[0])[which]
    path.unlink()
    refused(study_folder, StudyFolderError, f"{path.name}: missing")


def test_clips_of_another_pool_are_noticed(study_folder) -> None:
    feedback = study_folder.feedback
    arrays = {name: np.array(value) for name, value in vars(feedback.pool).items()}
    arrays["states"][0, 3, 0] += 0.5
    save_feedback(study_folder.pool_path, Feedback(SegmentPool(**arrays), feedback.queries))
    other = StudyFolder(study_folder.path)
    refused(other, StudyFolderError, "the clip of segment 0 shows something else")


def test_clips_drawn_with_other_settings_are_noticed(study_folder) -> None:
    larger = edit(study_folder, ("render_width = 96", "render_width = 128"))
    refused(larger, StudyFolderError, "shows something else")
