"""imitation 1.0.1 in a Python of its own, as a process to talk to."""

import os
import subprocess
from contextlib import contextmanager
from pathlib import Path

import pytest

HERE = Path(__file__).parent
PYTHON = Path(
    os.environ.get("IMITATION_PYTHON", HERE.parents[1] / ".venv-imitation" / "bin" / "python")
)


@contextmanager
def imitation(script, *arguments, folder):
    """A script of this folder under imitation's Python, on one thread, running in `folder`.

    Gives a function that writes a line to the script and returns the line that it answers with.
    """
    if not PYTHON.exists():
        pytest.skip(f"no Python with imitation at {PYTHON}; `make bench` makes one")
    errors = folder / "stderr.txt"
    with (
        open(errors, "w") as stderr,
        subprocess.Popen(
            [str(PYTHON), str(HERE / script), *map(str, arguments)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=stderr,
            cwd=folder,
            env=os.environ | {"OMP_NUM_THREADS": "1"},
            text=True,
        ) as process,
    ):

        def read():
            return process.stdout.readline().strip() or pytest.fail(errors.read_text())

        def ask(line):
            process.stdin.write(f"{line}\n")
            process.stdin.flush()
            return read()

        assert read() == "ready"
        yield ask
        process.stdin.close()
