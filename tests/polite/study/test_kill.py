"""A confirmed answer survives the server's death. `make bench` kills more often."""

import pytest
from study_kills import PARTICIPANTS, TRIALS, kill_often, sqlite_file

pytest_plugins = ["servers"]


@pytest.fixture(params=["sqlite", "postgresql"])
def served_by(request, study_folder):
    """The URL of a database without tables, and how many processes serve it."""
    if request.param == "sqlite":
        return sqlite_file(study_folder.path), 1
    server = request.getfixturevalue("postgresql_server")
    return server.url(server.create()), 2


def test_no_confirmed_answer_is_lost_or_doubled_when_the_server_is_killed(study_folder, served_by):
    url, workers = served_by
    killed = kill_often(study_folder, url, workers, kills=3, seed=1)
    print(killed)
    assert killed.confirmed >= PARTICIPANTS * TRIALS
    assert (killed.lost, killed.doubled) == (0, 0)


def test_twenty_kills(benchmark, study_folder, served_by):
    killed = benchmark.pedantic(kill_often, (study_folder, *served_by, 20, 2), rounds=1)
    print(killed)
    assert (killed.lost, killed.doubled) == (0, 0)
