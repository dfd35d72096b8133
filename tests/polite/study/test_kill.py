"""A confirmed answer survives the server's death. `make bench` kills more often."""

from study_kills import kill_often, sqlite_file


def test_no_confirmed_answer_is_lost_or_doubled_when_the_server_is_killed(study_folder):
    url = sqlite_file(study_folder.path)
    killed = kill_often(study_folder, url, workers=1, kills=3, seed=1)
    print(killed)
    assert killed.confirmed >= 40 * 13
    assert (killed.lost, killed.doubled) == (0, 0)
