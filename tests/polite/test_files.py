import hashlib
import json

import pytest

from polite.files import sha256, write_atomically, write_json
from polite.types import NotFiniteError


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
