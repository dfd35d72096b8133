"""What several tests of the command line share."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable

import pytest

from polite import cli


@pytest.fixture
def command_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[..., subprocess.CompletedProcess[str]]:
    """`polite ARGUMENTS` in this process, which has imported everything already."""

    def call(*arguments: object) -> subprocess.CompletedProcess[str]:
        monkeypatch.setattr(sys, "argv", ["polite", *map(str, arguments)])
        capsys.readouterr()
        code = 0
        try:
            cli.main()
        except SystemExit as stop:
            code = stop.code if isinstance(stop.code, int) else 1
        told = capsys.readouterr()
        return subprocess.CompletedProcess(sys.argv, code, told.out, told.err)

    return call
