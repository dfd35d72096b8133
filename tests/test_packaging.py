"""What `pip install .` would put on a machine."""

import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def names(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", folder],
        cwd=ROOT,
        check=True,
        capture_output=True,
    )
    (wheel,) = folder.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        return set(archive.namelist())


@pytest.mark.parametrize(
    "name",
    [
        "socialnav_env/py.typed",
        "socialnav_env/assets/sprites/robot.svg",
        "polite/py.typed",
        "polite/report/style.css",
        "polite/assets/corridor.png",
        "polite/assets/study_demo/study.toml",
        "polite/assets/study_demo/pool/segments.npz",
        "polite/experiments/new_study/template.toml",
        "polite/cli.py",
    ],
)
def test_the_wheel_carries(name, names):
    assert name in names


def test_the_wheel_carries_every_module_and_no_test(names):
    modules = {
        path.relative_to(ROOT).as_posix()
        for package in ("socialnav_env", "polite")
        for path in (ROOT / package).rglob("*.py")
    }
    assert modules <= names
    assert not [name for name in names if name.startswith("tests/")]
