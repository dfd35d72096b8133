import hashlib
import json
import os

import pytest

from polite.files import (
    is_temporary,
    one_line,
    read_json_object,
    remove_temporaries,
    sha256,
    write_atomically,
    write_json,
)
from polite.types import NotFiniteError, PoliteError


def test_a_file_is_written_whole_and_its_folder_made(tmp_path):
    path = tmp_path / "new" / "note.txt"
    write_atomically(path, lambda temporary: temporary.write_text("done"))
    assert path.read_text() == "done"
    assert [file.name for file in path.parent.iterdir()] == ["note.txt"]


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path):
    path = tmp_path / "note.txt"
    path.write_text("old")

    def fail(temporary):
        temporary.write_text("half")
        raise RuntimeError("killed")

    with pytest.raises(RuntimeError, match="killed"):
        write_atomically(path, fail)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_the_temporary_file_has_the_same_suffix_and_folder(tmp_path):
    seen = []
    write_atomically(tmp_path / "a.npz", lambda p: (seen.append(p), p.write_bytes(b"")))
    assert seen[0].suffix == ".npz" and seen[0].parent == tmp_path


def leave_temporary(path):
    """Let a process die between the temporary file and its renaming."""

    def die(temporary):
        temporary.write_text("half")
        os._exit(1)

    child = os.fork()
    if child == 0:
        write_atomically(path, die)
    os.waitpid(child, 0)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
@pytest.mark.parametrize("name", ["run.json", "a-b.tar.gz", "bare"])
def test_what_a_killed_process_left_is_known_and_removed(tmp_path, name):
    path = tmp_path / "deep" / name
    leave_temporary(path)
    (left,) = path.parent.iterdir()
    assert is_temporary(left)
    remove_temporaries(tmp_path)
    assert not list(path.parent.iterdir())


def test_nothing_else_is_taken_for_a_temporary_file(tmp_path):
    digits = "0123456789abcdef" * 2
    names = ["run.json", f"run-{digits}.json", f".run-{digits[1:]}.json", ".hidden", ".a-b.json"]
    for name in names:
        (tmp_path / name).write_text("mine")
    (tmp_path / f".run-{digits}").mkdir()
    remove_temporaries(tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {*names, f".run-{digits}"}


def test_a_place_that_cannot_be_written_is_a_one_line_error(tmp_path):
    (tmp_path / "file").write_text("mine")
    with pytest.raises(PoliteError, match=r"a\.json: cannot be written \(Not a directory\)"):
        write_json(tmp_path / "file" / "deep" / "a.json", {})
    (tmp_path / "folder").mkdir()
    with pytest.raises(PoliteError, match=r"folder: cannot be written"):
        write_json(tmp_path / "folder", {})
    assert {path.name for path in tmp_path.iterdir()} == {"file", "folder"}


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (None, "cannot be read"),
        (b"", "expected JSON"),
        (b'{"a": 1', "expected JSON"),
        (b"\xff\xfe", "expected JSON"),
        (b"[]", "expected a JSON object, found list"),
    ],
)
def test_what_is_no_json_object_is_a_one_line_error_with_a_remedy(tmp_path, content, says):
    path = tmp_path / "a.json"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(PoliteError, match=rf"a\.json: {says}.*; do this$") as caught:
        read_json_object(path, "do this")
    assert "\n" not in str(caught.value)


def test_an_error_in_one_line_is_never_empty_or_long():
    assert one_line(ValueError("two\n  lines")) == "two lines"
    assert one_line(EOFError()) == "EOFError"
    assert len(one_line(ValueError("x" * 1000))) == 300


def test_json_round_trip(tmp_path):
    content = {"numbers": [1, 2.5, None], "name": "λ"}
    write_json(tmp_path / "a.json", content)
    assert json.loads((tmp_path / "a.json").read_text("utf-8")) == content


@pytest.mark.parametrize("bad", [float("nan"), float("inf")])
def test_json_without_nan(tmp_path, bad):
    with pytest.raises(NotFiniteError, match=r"a\.json: cannot write NaN"):
        write_json(tmp_path / "a.json", {"x": bad})
    assert not list(tmp_path.iterdir())


def test_sha256(tmp_path):
    (tmp_path / "a").write_bytes(b"abc")
    assert sha256(tmp_path / "a") == hashlib.sha256(b"abc").hexdigest()
