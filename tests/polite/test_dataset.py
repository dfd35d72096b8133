import json

import numpy as np
import pytest

from polite.dataset import ANSWERS, FILES, MANIFEST, QUERIES, DatasetError, Feedback, load_feedback
from polite.dataset import save_feedback as save
from polite.files import sha256
from polite.types import Answer, Highlight, InvalidValueError, Query, Segment, SegmentPool


def segment(steps, seed):
    rng = np.random.default_rng(seed)
    return Segment(
        observations=rng.normal(size=(steps, 3)),
        actions=rng.normal(size=(steps, 2)),
        rewards=rng.normal(size=steps),
        states=rng.normal(size=(steps, 4)),
        trajectory=seed,
        start=seed + 1,
    )


POOL = SegmentPool.stack([segment(5, 0), segment(2, 1), segment(4, 2)], length=5)
QUERIES_ = [Query(0, 1), Query(2, 0)]
ANSWERS_ = [
    Answer(0, (1.0, 0.0), Highlight(4, 2), Highlight(0, 2), participant=3, seconds=41.5),
    Answer(1, (0.5, 0.5), participant=3, seconds=0.1),
    Answer(0, (0.0, 1.0), positive=Highlight(4, 2), marks_other=True),
]


def test_what_is_saved_is_loaded_exactly(tmp_path):
    save(tmp_path / "data", Feedback(POOL, QUERIES_, ANSWERS_))
    loaded = load_feedback(tmp_path / "data")
    assert loaded.queries == QUERIES_ and loaded.answers == ANSWERS_
    for name in vars(POOL):
        saved, back = getattr(POOL, name), getattr(loaded.pool, name)
        np.testing.assert_array_equal(back, saved)
        assert back.dtype == saved.dtype


def test_the_folder_holds_the_promised_files_and_no_pickle(tmp_path):
    save(tmp_path, Feedback(POOL, QUERIES_, ANSWERS_))
    assert {file.name for file in tmp_path.iterdir()} == {*FILES, MANIFEST}
    with np.load(tmp_path / FILES[0], allow_pickle=False) as arrays:
        assert set(arrays) == set(vars(POOL))
    assert len((tmp_path / ANSWERS).read_text().splitlines()) == len(ANSWERS_)


def test_equal_feedback_gives_equal_bytes(tmp_path):
    for name in ("a", "b"):
        save(tmp_path / name, Feedback(POOL, QUERIES_, ANSWERS_))
    for file in (*FILES, MANIFEST):
        assert (tmp_path / "a" / file).read_bytes() == (tmp_path / "b" / file).read_bytes()


def test_no_answers_yet_is_a_data_set_too(tmp_path):
    save(tmp_path, Feedback(POOL, QUERIES_))
    assert load_feedback(tmp_path).answers == []


@pytest.mark.parametrize("name", FILES)
def test_a_file_cut_short_is_named_with_both_checksums(tmp_path, name):
    save(tmp_path, Feedback(POOL, QUERIES_, ANSWERS_))
    expected = json.loads((tmp_path / MANIFEST).read_text())["sha256"][name]
    content = (tmp_path / name).read_bytes()
    (tmp_path / name).write_bytes(content[:-3])
    with pytest.raises(DatasetError, match=rf"{name}.*expected SHA-256 {expected}, got \w{{64}};"):
        load_feedback(tmp_path)


@pytest.mark.parametrize("name", FILES)
def test_a_single_altered_byte_or_a_missing_file_is_noticed(tmp_path, name):
    save(tmp_path, Feedback(POOL, QUERIES_, ANSWERS_))
    content = bytearray((tmp_path / name).read_bytes())
    content[len(content) // 2] ^= 1
    (tmp_path / name).write_bytes(bytes(content))
    with pytest.raises(DatasetError, match=name):
        load_feedback(tmp_path)
    (tmp_path / name).unlink()
    with pytest.raises(DatasetError, match=f"{name}.*no file"):
        load_feedback(tmp_path)


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"version": 1}', "\x00"])
def test_a_damaged_manifest_is_named(tmp_path, text):
    save(tmp_path, Feedback(POOL, QUERIES_, ANSWERS_))
    (tmp_path / MANIFEST).write_text(text)
    with pytest.raises(DatasetError, match=rf"{MANIFEST}: cut short or altered"):
        load_feedback(tmp_path)


def test_another_version_or_no_data_set_is_an_error(tmp_path):
    with pytest.raises(DatasetError, match=f"{MANIFEST}: missing"):
        load_feedback(tmp_path / "nowhere")
    save(tmp_path, Feedback(POOL, QUERIES_, ANSWERS_))
    content = json.loads((tmp_path / MANIFEST).read_text())
    (tmp_path / MANIFEST).write_text(json.dumps({**content, "version": 99}))
    with pytest.raises(DatasetError, match="expected version 1, got 99"):
        load_feedback(tmp_path)


def test_contents_that_are_no_feedback_are_an_error_even_with_good_checksums(tmp_path):
    save(tmp_path, Feedback(POOL, QUERIES_, ANSWERS_))
    _forge(tmp_path, QUERIES, "[[0, 99], [1, 2]]")
    with pytest.raises(DatasetError, match="not a feedback data set"):
        load_feedback(tmp_path)
    _forge(tmp_path, QUERIES, "[[0]]")
    with pytest.raises(DatasetError, match="not a feedback data set"):
        load_feedback(tmp_path)


def _forge(folder, name, text):
    (folder / name).write_text(text)
    manifest = json.loads((folder / MANIFEST).read_text())
    manifest["sha256"][name] = sha256(folder / name)
    (folder / MANIFEST).write_text(json.dumps(manifest))


@pytest.mark.parametrize(
    ("queries", "answers", "message"),
    [
        ([Query(0, 3)], [], "expected indices below 3"),
        (QUERIES_, [Answer(2, (0.0, 0.0))], "expected query < 2"),
        (QUERIES_, [Answer(0, (0.0, 1.0), Highlight(2, 5))], "end before 2"),
        (QUERIES_, [Answer(1, (0.0, 1.0), Highlight(4, 1), marks_other=True)], "end before 4"),
    ],
)
def test_parts_that_do_not_belong_together_are_not_written(tmp_path, queries, answers, message):
    save(tmp_path, Feedback(POOL, QUERIES_, ANSWERS_))
    with pytest.raises(InvalidValueError, match=message):
        save(tmp_path, Feedback(POOL, queries, answers))
    assert load_feedback(tmp_path).answers == ANSWERS_


def test_a_save_that_was_killed_does_not_look_whole(tmp_path, monkeypatch):
    save(tmp_path, Feedback(POOL, QUERIES_, ANSWERS_))

    def killed(path, content):
        raise KeyboardInterrupt

    monkeypatch.setattr("polite.dataset.write_json", killed)
    with pytest.raises(KeyboardInterrupt):
        save(tmp_path, Feedback(POOL, QUERIES_))
    with pytest.raises(DatasetError, match="not whole"):
        load_feedback(tmp_path)
