"""A study that is served by processes of its own, which can be killed."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

from polite.study.database import Database
from polite.study.invitations import invite

PATIENCE = 60.0
"""How long a server may take until it answers [s]."""


class ServedStudy:
    """`polite serve` in a process group of its own."""

    def __init__(self, folder: Path, database_url: str, workers: int = 1) -> None:
        """Prepare it; the port is the same after each start."""
        with socket.create_server(("127.0.0.1", 0)) as free:
            self.port = free.getsockname()[1]
        self.base = f"http://127.0.0.1:{self.port}"
        self.log = folder.parent / "server.log"
        self._command = [
            *(sys.executable, "-c", "from polite.cli import main; main()", "serve", str(folder)),
            *("--port", str(self.port), "--workers", str(workers), "--database", database_url),
        ]
        self._process: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        """Start it; it answers some time later."""
        with self.log.open("ab") as log:
            self._process = subprocess.Popen(
                self._command, stdout=log, stderr=log, stdin=subprocess.DEVNULL,
                start_new_session=True,
            )  # fmt: skip

    @property
    def pid(self) -> int:
        """Of the first process."""
        assert self._process is not None
        return self._process.pid

    def wait_until_up(self) -> None:
        """Until it accepts connections."""
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            assert self._process is not None and self._process.poll() is None, self.log.read_text()
            try:
                socket.create_connection(("127.0.0.1", self.port), 1.0).close()
                return
            except OSError:
                time.sleep(0.05)  # nothing says when another process begins to listen
        raise AssertionError(f"no answer within {PATIENCE:g} s: {self.log.read_text()}")

    def kill(self) -> None:
        """SIGKILL to all of its processes at once, in the middle of whatever they do."""
        if self._process is not None:
            os.killpg(self._process.pid, signal.SIGKILL)
            self._process.wait()
            self._process = None


def open_invitation(database_url: str, cap: int) -> str:
    """The path of a new link for many."""
    database = Database(database_url)
    database.migrate()
    with database.write() as connection:
        (link,) = invite(connection, 1, cap, time.time())
    database.close()
    return link.path
