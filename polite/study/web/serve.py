"""Serving a study: the command's work, and the application of each worker process."""

from __future__ import annotations

import os
import socket
import time
from pathlib import Path
from typing import Final

import uvicorn
from fastapi import FastAPI
from rich.console import Console
from sqlalchemy import insert

from polite.files import system_says
from polite.study import schema
from polite.study.database import Database
from polite.study.design import FILE
from polite.study.folder import StudyFolder
from polite.study.invitations import invite, list_invitations
from polite.study.opening import DATABASE, check_study, open_database
from polite.study.web.app import create_app
from polite.types import PoliteError

FOLDER, HTTPS = "POLITE_STUDY", "POLITE_HTTPS"
"""With `DATABASE`, how worker processes learn what they serve."""
BACKLOG: Final = 2048
"""Connections that may wait to be accepted."""


def serve(
    folder: StudyFolder, host: str, port: int, workers: int, database_url: str, https: bool
) -> None:
    """Serve a study until somebody stops it.

    Raises:
        PoliteError: The folder is not whole or not what people took part in, or database or port
            cannot be used.
    """
    folder.check()
    database = open_database(folder, database_url)
    check_study(folder, database)
    _keep_pool(folder, database)
    _check_port(host, port)
    _tell(folder, database, host, port)
    settings = {
        "host": host,
        "port": port,
        "access_log": False,  # addresses hold invitations and what a panel calls a person
        "log_level": "warning",
        "backlog": BACKLOG,
        "server_header": False,
    }
    if workers == 1:
        uvicorn.run(create_app(folder, database, https=https), **settings)  # type: ignore[arg-type]
        return
    database.close()
    os.environ[FOLDER], os.environ[HTTPS] = str(folder.path), str(int(https))
    if database_url:
        os.environ[DATABASE] = database_url
    uvicorn.run(f"{__name__}:worker", factory=True, workers=workers, **settings)  # type: ignore[arg-type]


def worker() -> FastAPI:
    """The application of a worker process."""
    folder = StudyFolder(Path(os.environ[FOLDER]))
    database = open_database(folder, "")
    check_study(folder, database)  # a worker that died is replaced, perhaps after an edit
    return create_app(folder, database, https=os.environ[HTTPS] == "1")


def _keep_pool(folder: StudyFolder, database: Database) -> None:
    """Remember which segments and comparisons answers refer to from now on."""
    with database.write() as connection:
        connection.execute(schema.pools.delete())
        connection.execute(insert(schema.pools).values(sha=folder.pool_checksum))


def _check_port(host: str, port: int) -> None:
    """Find out now, in a sentence, what the server would say later in many.

    Raises:
        PoliteError: It cannot be listened on.
    """
    try:
        with socket.create_server((host, port)):
            pass
    except (OSError, OverflowError) as error:
        reason = system_says(error) if isinstance(error, OSError) else str(error)
        raise PoliteError(f"{host}:{port}: cannot be served on ({reason}); give another") from error


def _tell(folder: StudyFolder, database: Database, host: str, port: int) -> None:
    """Say where the pages are; without an invitation an open one is made, to begin at once."""
    wanted = 2 * folder.design.participants
    with database.write() as connection:
        if not list_invitations(connection):
            invite(connection, 1, wanted, time.time())
        invitations = list_invitations(connection)
    base = f"http://{'localhost' if host in ('0.0.0.0', '127.0.0.1', '::') else host}:{port}"
    open_one = next((each for each in invitations if each.used < each.cap), None)
    console = Console(soft_wrap=True, highlight=False)
    console.print(f"{folder.design.title}", markup=False, style="bold")
    if missing := folder.design.placeholders:
        named = f"warning: {FILE} still has placeholders to fill in: {', '.join(missing)}"
        console.print(named, markup=False, style="yellow")
    if open_one:
        console.print(f"participants  {base}{open_one.path}", markup=False)
        console.print(f"              {open_one.cap - open_one.used} may still join by this link")
    console.print(f"researcher    {base}/researcher", markup=False)
    console.print(f"              its token stands in {folder.path / 'secrets.json'}", markup=False)
    console.print("stop with Ctrl+C; nothing is lost then")
