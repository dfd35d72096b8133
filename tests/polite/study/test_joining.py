import threading
from collections import Counter
from concurrent.futures import ThreadPoolExecutor

import pytest
from people import World, row_counts, rows

from polite.study import schema
from polite.study.errors import RefusedError
from polite.study.identities import write_identities
from polite.study.invitations import invite, list_invitations, panel_identities
from polite.study.participants import (
    STILL_HERE,
    clean_code,
    completion_code,
    hashed,
    invitation_is_open,
    join,
)
from polite.study.reading import read_records
from polite.study.withdrawal import has_code
from polite.types import InvalidValueError

pytest_plugins = ["servers"]


@pytest.fixture
def world(study_folder, database):
    return World(study_folder, database)


def at_once(threads: int, work) -> list:
    """What `work` returns or raises in threads that begin together."""
    together = threading.Barrier(threads)

    def run(index: int):
        together.wait()
        try:
            return work(index)
        except RefusedError as error:
            return error

    with ThreadPoolExecutor(threads) as pool:
        return list(pool.map(run, range(threads)))


def places(world) -> Counter:
    return Counter((r["condition"], r["block"]) for r in rows(world.database, schema.participants))


def test_twenty_who_join_at_once_are_in_balance(world):
    (link,) = world.invite(cap=20)
    tokens = at_once(20, lambda _: world.join(link))
    assert len({world.person(token).number for token in tokens}) == 20
    blocks = range(world.design.participants)
    assert places(world) == Counter({(c, b): 5 for c in ("polite", "baseline") for b in blocks})


def test_an_open_invitation_lets_in_as_many_as_its_cap(world):
    (link,) = world.invite(cap=7)
    results = at_once(20, lambda _: world.join(link))
    refused = [each for each in results if isinstance(each, RefusedError)]
    assert len(refused) == 13 and {each.status for each in refused} == {410}
    assert row_counts(world.database)["participants"] == 7
    with world.database.read() as connection:
        (only,) = list_invitations(connection)
        assert (only.used, only.cap, only.kind) == (7, 7, "open")
        assert not invitation_is_open(connection, link)


def test_a_personal_invitation_is_used_once(world):
    links = world.invite(3, cap=1)
    results = at_once(12, lambda index: world.join(links[index % 3]))
    assert sum(isinstance(each, RefusedError) for each in results) == 9
    people = rows(world.database, schema.participants)
    assert sorted(r["invitation"] for r in people) == sorted(links)


def test_a_consent_that_is_sent_twice_makes_one_participant(world):
    """A double click, or an answer that was lost on its way: the link is not used up by it."""
    (link,) = world.invite(cap=1)

    def consent(_: int) -> None:
        with world.database.write() as connection:
            join(connection, world.design, link, {"PROLIFIC_PID": "x"}, "same token", world.now)

    assert at_once(4, consent) == [None] * 4
    assert world.person("same token").number == 1
    counts = row_counts(world.database)
    assert (counts["participants"], counts["identities"]) == (1, 1)
    assert counts["trials"] == world.material.trials


def test_an_unknown_invitation_is_refused_and_stores_nothing(world):
    with pytest.raises(RefusedError, match="not known") as caught:
        world.join("nonsense")
    assert caught.value.status == 404
    assert set(row_counts(world.database).values()) == {0}


def test_what_is_stored_of_somebody_new(world):
    token = world.join(PROLIFIC_PID="5f")
    (row,) = rows(world.database, schema.participants)
    assert row["session"] == hashed(token) != token
    assert row["stage"] == "guide" and row["finished_at"] is None
    assert row["consent_version"] == world.design.consent.version
    assert row["joined_at"] == row["last_seen"] == world.now
    trials = rows(world.database, schema.trials)
    assert [t["place"] for t in trials] == list(range(world.material.trials))
    assert all(t["served_at"] is None and t["watched_at"] is None for t in trials)
    identity = {"participant": 1, "name": "PROLIFIC_PID", "value": "5f"}
    assert rows(world.database, schema.identities) == [identity]


def test_the_design_is_stored_once(world):
    for _ in range(3):
        world.join()
    (row,) = rows(world.database, schema.designs)
    assert type(world.design).model_validate_json(row["content"]) == world.design


def test_who_has_dropped_out_is_replaced_at_their_block(world):
    wanted = 2 * world.design.participants
    tokens = [world.join() for _ in range(wanted)]
    assert set(places(world).values()) == {1}
    gone, *others = (world.person(token) for token in tokens)
    world.go_to(tokens[1], "done")
    world.now += STILL_HERE + 1.0
    for token in tokens[2:]:
        if world.person(token).stage == "guide":
            world.advance(token)  # is heard of
    replacement = world.person(world.join())
    assert (replacement.condition, replacement.block) == (gone.condition, gone.block)
    assert replacement.number == wanted + 1 and len(others) == wanted - 1


def test_somebody_who_was_seen_an_hour_ago_still_counts(world):
    for _ in range(2 * world.design.participants):
        world.join()
    world.now += STILL_HERE
    for _ in range(2 * world.design.participants):
        world.join()
    assert set(places(world).values()) == {2}


def test_records_are_what_happened(world):
    token = world.join_as("polite")
    world.go_to(token, "comparisons")
    place = world.current(token)
    world.answer(token, place, choice="right", good=2, nothing=False)
    first = world.now
    world.answer(token, place, revision=1, choice="equal", nothing=False)
    with world.database.read() as connection:
        records = read_records(connection)
    (mine,) = (p for p in records.participants if p.number == world.person(token).number)
    assert (mine.condition, mine.stage, mine.robot) == ("polite", "comparisons", False)
    assert len(mine.trials) == world.material.trials
    one, two = mine.revisions()[place]
    assert (one.choice, one.good, one.bad, one.nothing) == ("right", 2, None, False)
    assert (two.choice, two.good, two.bad, two.nothing) == ("equal", None, None, False)
    assert one.received_at == one.watched_at == first
    assert (one.client_shown_at, one.client_answered_at) == (1.0, 7.0)
    assert records.withdrawn == {}


def test_who_people_are_can_be_written_apart(world, tmp_path):
    done, named = world.join(SESSION_ID="s", PROLIFIC_PID="p"), world.join(PROLIFIC_PID="q")
    world.go_to(done, "done")
    code = completion_code(world.person(done).code)
    with world.database.read() as connection:
        write_identities(connection, world.design, tmp_path / "who.csv")
    assert (tmp_path / "who.csv").read_text(encoding="utf-8").splitlines() == [
        "participant,finished,field,value,completion_code",
        f"1,true,PROLIFIC_PID,p,{code}",
        f"1,true,SESSION_ID,s,{code}",
        f"{world.person(named).number},false,PROLIFIC_PID,q,",
    ]


@pytest.mark.parametrize(("links", "cap"), [(0, 1), (1, 0), (10_001, 1), (1, 10_001), (-1, 1)])
def test_invitations_have_limits(world, links, cap):
    wrong = pytest.raises(InvalidValueError, match=r"expected 1 to 10,000")
    with wrong, world.database.write() as connection:
        invite(connection, links, cap, 0.0)
    assert row_counts(world.database)["invitations"] == 0


def test_invitations_cannot_be_guessed(world):
    made = world.invite(200, cap=1)
    assert len(set(made)) == 200 and all(len(token) == 22 for token in made)  # 128 bits
    with world.database.read() as connection:
        listed = list_invitations(connection)
    assert {each.token for each in listed} == set(made)
    assert {(each.kind, each.path[:6]) for each in listed} == {("personal", "/join/")}


def test_codes_are_read_however_they_are_typed(world):
    code = world.person(world.join()).code
    assert len(code) == 19 and code == clean_code(code)
    with world.database.read() as connection:
        for typed in (code.lower(), code.replace("-", ""), f" {code.replace('-', ' ')}\n"):
            assert has_code(connection, typed)
        for wrong in ("", "-", code[:-1], code + "A", "%", "_" * 19, "\x00", "AAAA" * 4):
            assert not has_code(connection, wrong)


def test_the_completion_code_does_not_withdraw(world):
    people = [world.person(world.join()) for _ in range(20)]
    codes = {completion_code(person.code) for person in people}
    assert len(codes) == 20 and not codes & {person.code for person in people}
    with world.database.read() as connection:
        assert not any(has_code(connection, code) for code in codes)


def test_only_what_a_panel_writes_is_kept_of_a_link():
    query = {
        "PROLIFIC_PID": "5f3c",
        "SESSION_ID": "<script>",
        "workerId": "A" * 101,
        "hitId": "",
        "participant": "7",
        "STUDY_ID": "a b",
    }
    assert panel_identities(query) == {"PROLIFIC_PID": "5f3c"}
