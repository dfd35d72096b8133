import threading
from concurrent.futures import ThreadPoolExecutor

import pytest
from hypothesis import given
from hypothesis import strategies as st
from people import World, a_choice, answer_form, row_counts, rows
from pydantic import ValidationError

from polite.study import schema
from polite.study.answering import TOLERANCE, current_place, read_place
from polite.study.design import Question
from polite.study.errors import RefusedError
from polite.study.participants import find
from polite.study.questionnaire import LONGEST, read_form, store_questionnaire

pytest_plugins = ["servers"]

LENGTH, STEPS = 3, 12
"""Of a highlight and of the clips of the study."""


@pytest.fixture
def world(study_folder, database):
    return World(study_folder, database)


@pytest.fixture
def polite(world):
    """Somebody who is asked for highlights and has come to the comparisons."""
    token = world.join_as("polite")
    world.go_to(token, "comparisons")
    return token


@pytest.fixture
def baseline(world):
    token = world.join_as("baseline")
    world.go_to(token, "comparisons")
    return token


def stored_answers(world, token) -> list[dict]:
    return rows(world.database, schema.answers, participant=world.person(token).number)


def refused(status: int, match: str):
    """Expect a refusal with a status."""

    class Check:
        def __enter__(self):
            self.raises = pytest.raises(RefusedError, match=match)
            self.caught = self.raises.__enter__()
            return self.caught

        def __exit__(self, *error):
            done = self.raises.__exit__(*error)
            assert self.caught.value.status == status
            return done

    return Check()


def together(*works) -> list:
    """What functions return or raise that begin at once in threads of their own."""
    barrier = threading.Barrier(len(works))

    def run(work):
        barrier.wait()
        try:
            return work()
        except RefusedError as error:
            return error

    with ThreadPoolExecutor(len(works)) as pool:
        return list(pool.map(run, works))


def test_a_changed_answer_is_a_further_row(world, baseline):
    place = world.current(baseline)
    for revision, choice in enumerate(("left", "right", "equal")):
        world.answer(baseline, place, revision=revision, choice=choice)
    seen = [a for a in stored_answers(world, baseline) if a["place"] == place]
    assert [(a["revision"], a["choice"]) for a in seen] == [(1, "left"), (2, "right"), (3, "equal")]
    assert world.current(baseline) == place + 1


@pytest.mark.parametrize("revision", [0, 2, 7])
def test_a_revision_of_another_tab_is_refused(world, baseline, revision):
    place = world.current(baseline)
    world.answer(baseline, place)
    before = row_counts(world.database)
    with refused(409, "another window") as caught:
        world.store(baseline, place, answer_form(revision=revision))
    assert caught.value.more == {"revision": 1, "current": place + 1}
    assert row_counts(world.database) == before


def test_of_two_tabs_that_answer_at_once_one_is_stored(world, baseline):
    place = world.current(baseline)
    world.watch(baseline, place)
    results = together(
        *(
            lambda choice=choice: world.store(baseline, place, answer_form(choice=choice))
            for choice in ("left", "right")
        )
    )
    assert sorted(isinstance(each, RefusedError) for each in results) == [False, True]
    seen = [a for a in stored_answers(world, baseline) if a["place"] == place]
    kept = ("left", "right")[[isinstance(each, RefusedError) for each in results].index(False)]
    assert [(a["revision"], a["choice"]) for a in seen] == [(1, kept)]


def test_an_answer_that_is_sent_again_is_the_same_answer(world, baseline):
    place = world.current(baseline)
    world.watch(baseline, place)
    form = answer_form(choice="right")
    first = world.store(baseline, place, form)
    before = row_counts(world.database)
    assert world.store(baseline, place, form) == first
    assert row_counts(world.database) == before


def test_an_answer_that_is_sent_four_times_at_once_is_stored_once(world, baseline):
    place = world.current(baseline)
    world.watch(baseline, place)
    form = answer_form()
    results = together(*[lambda: world.store(baseline, place, form)] * 4)
    assert len({(each.revision, each.next, each.stage) for each in results}) == 1
    assert sum(a["place"] == place for a in stored_answers(world, baseline)) == 1


def test_an_answer_may_arrive_again_when_the_participant_has_gone_on(world, baseline):
    """The confirmation of the very last one may be lost as well."""
    place = world.material.trials - 1
    while world.current(baseline) < place:
        world.answer(baseline, world.current(baseline))
    world.watch(baseline, place)
    form = answer_form()
    assert world.store(baseline, place, form).stage == "questions"
    assert world.store(baseline, place, form).stage == "questions"
    assert world.store(baseline, place, form).next is None


def test_a_submission_of_another_comparison_is_refused(world, baseline):
    place = world.current(baseline)
    world.watch(baseline, place)
    form = answer_form()
    world.store(baseline, place, form)
    world.watch(baseline, place + 1)
    with refused(422, "submission: expected a new one"):
        world.store(baseline, place + 1, form)
    assert world.current(baseline) == place + 1


def test_what_others_call_their_answers_does_not_matter(world, baseline):
    """Two participants may use one id: nobody learns from an error that another has used it."""
    form = answer_form()
    other = world.join_as("baseline")
    world.go_to(other, "comparisons")
    for token in (baseline, other):
        place = world.current(token)
        world.watch(token, place)
        assert world.store(token, place, form).revision == 1


def test_places_come_in_order(world, baseline):
    place = world.current(baseline)
    for later in (place + 1, world.material.trials, 9999):
        with refused(404, "not yours"):
            world.answer(baseline, later)
    world.answer(baseline, place)
    assert world.current(baseline) == place + 1


def test_practice_is_over_once_the_comparisons_have_begun(world, baseline):
    with refused(404, "not yours"):
        world.answer(baseline, 0, revision=1)
    with world.database.read() as connection, refused(404, "not yours"):
        read_place(connection, find(connection, baseline), world.material, 0)


def test_a_comparison_does_not_come_before_the_practice(world):
    token = world.join()
    with refused(409, "nothing to compare"):
        world.answer(token, 0)
    world.advance(token)
    with refused(404, "not yours"):
        world.answer(token, world.material.practice)
    world.answer(token, 0)
    assert world.person(token).stage == "comparisons"


def test_nothing_is_compared_after_the_end(world, baseline):
    world.go_to(baseline, "questions")
    before = row_counts(world.database)
    for place in range(world.material.trials + 1):
        with refused(409, "nothing to compare"):
            world.store(baseline, place, answer_form(revision=1))
    assert row_counts(world.database) == before


def test_clips_cannot_be_watched_faster_than_they_play(world, baseline):
    place = world.current(baseline)
    with world.database.read() as connection:
        at = read_place(connection, find(connection, baseline), world.material, place)
    fps = next(iter(world.material.clips.values())).fps
    shortest = world.material.shortest_watch(at.trial)
    assert shortest == pytest.approx(STEPS / fps / 2.0)  # the highest speed
    with refused(422, "watch both clips"):
        world.watch(baseline, place, seconds=TOLERANCE * shortest - 0.01)
    with refused(422, "watch both clips"):
        world.store(baseline, place, answer_form())
    world.watch(baseline, place, seconds=0.02)  # in all, now
    assert world.store(baseline, place, answer_form()).revision == 1


def test_watching_counts_from_the_first_time_on(world, baseline):
    place = world.current(baseline)
    number = world.person(baseline).number
    world.watch(baseline, place)
    (first,) = rows(world.database, schema.trials, participant=number, place=place)
    world.watch(baseline, place, seconds=500.0)
    (second,) = rows(world.database, schema.trials, participant=number, place=place)
    assert first == second and first["watched_at"] == first["served_at"] + 60.0


MARKED = {"good": 1, "nothing": False}


@pytest.mark.parametrize(
    "values",
    [
        {"nothing": False},
        {"nothing": True, "good": 1},
        {"nothing": True, "bad": 1},
        {"good": STEPS - LENGTH, "nothing": False},
        {"good": 0, "bad": 1000, "nothing": False},
        {"choice": "equal", "good": 1, "nothing": False},
        {"choice": "incomparable", "nothing": True},
    ],
)
def test_not_a_whole_answer_with_highlights(world, polite, values):
    before = stored_answers(world, polite)
    with refused(422, r"Expected|Passages"):
        world.answer(polite, world.current(polite), **values)
    assert stored_answers(world, polite) == before


@pytest.mark.parametrize(
    "values",
    [
        {"nothing": True},
        {"good": 0, "nothing": False},
        {"bad": STEPS - 1 - LENGTH, "nothing": False},
        {"good": 4, "bad": 4, "nothing": False},
        {"choice": "right", "good": 0, "bad": STEPS - 1 - LENGTH, "nothing": False},
        {"choice": "equal", "nothing": False},
        {"choice": "incomparable", "nothing": False},
    ],
)
def test_a_whole_answer_with_highlights(world, polite, values):
    place = world.current(polite)
    world.answer(polite, place, **values)
    *_, last = stored_answers(world, polite)
    wanted = {"choice": "left", "good": None, "bad": None} | values
    wanted["nothing_marked"] = wanted.pop("nothing")
    assert {name: last[name] for name in wanted} == wanted


@pytest.mark.parametrize("marks", [{"good": 1}, {"bad": 1}, {"nothing": True}])
def test_preferences_only_take_no_highlights(world, baseline, marks):
    with refused(422, "Passages can be marked"):
        world.answer(baseline, world.current(baseline), **marks)


def test_windows_lie_within_the_preferred_clip(world, polite):
    """Its length counts, not that of the other clip."""
    place = world.current(polite)
    with world.database.read() as connection:
        trial = read_place(connection, find(connection, polite), world.material, place).trial
    left, _ = world.material.sides(trial)
    shorter = {
        index: (clip if clip.name != left.name else type(clip)(clip.name, 2, clip.fps, 2, 2))
        for index, clip in world.material.clips.items()
    }
    world.material = type(world.material)(world.design, world.material.queries, shorter)
    with refused(422, "step 0 to 0 of the clip"):
        world.answer(polite, place, choice="left", good=1, nothing=False)
    assert world.answer(polite, place, choice="left", good=0, nothing=False).revision == 1


def test_times_are_those_of_the_server_and_of_the_page(world, baseline):
    place = world.current(baseline)
    world.answer(baseline, place, shown_at=1.0, watched_at=2.0, chosen_at=3.0, answered_at=4.0)
    *_, last = stored_answers(world, baseline)
    assert last["received_at"] == world.now
    names = ("shown", "watched", "chosen", "answered")
    assert [last[f"client_{name}_at"] for name in names] == [0.001, 0.002, 0.003, 0.004]


def test_the_next_comparison_is_served_with_the_answer_but_not_after_practice(world):
    """After practice the page shows feedback first."""
    token = world.join()
    world.advance(token)
    number = world.person(token).number
    world.answer(token, 0)

    def served(place):
        (row,) = rows(world.database, schema.trials, participant=number, place=place)
        return row["served_at"]

    assert served(1) is None
    stored = world.answer(token, 1)
    assert stored.next == 2 and served(2) == world.now


def test_a_participant_who_withdraws_while_answering(world, baseline):
    """Either the answer comes first and is deleted, or it is not stored: nothing is left."""
    from polite.study.withdrawal import by_code, withdraw

    place = world.current(baseline)
    world.watch(baseline, place)
    person = world.person(baseline)

    def leave():
        with world.database.write() as connection:
            return withdraw(connection, by_code(person.code), world.now)

    first, *left = together(lambda: world.store(baseline, place, answer_form()), *[leave] * 3)
    assert sorted(left) == [False, False, True]
    assert not isinstance(first, RefusedError) or first.status == 410
    assert rows(world.database, schema.answers, participant=person.number) == []
    assert row_counts(world.database)["withdrawals"] == 1


@given(st.dictionaries(st.sampled_from(sorted(answer_form().model_dump())), st.none()))
def test_an_answer_with_values_missing_names_them(missing):
    whole = answer_form(good=1, bad=2).model_dump()
    values = {name: value for name, value in whole.items() if name not in missing}
    needed = set(missing) - {"good", "bad", "nothing", "replays"}
    if not needed:
        assert answer_form(**values)
        return
    with pytest.raises(ValidationError) as caught:
        type(answer_form())(**values)
    assert {error["loc"][0] for error in caught.value.errors()} == needed


SCALE = Question(name="scale", text="?", kind="scale", points=5)
CHOICE = Question(name="choice", text="?", kind="choice", options=("a", "<b>"))
NUMBER = Question(name="number", text="?", kind="number", required=False)
TEXT = Question(name="text", text="?", kind="text", required=False)


@pytest.fixture
def asking(study_folder):
    def ask(question, text):
        design = study_folder.design.model_copy(update={"questions": (question,)})
        return read_form(design, {question.name: text})

    return ask


@pytest.mark.parametrize(
    ("question", "text", "value"),
    [
        (SCALE, " 5 ", 5.0),
        (SCALE, "1", 1.0),
        (CHOICE, "<b>", "<b>"),
        (NUMBER, "2,5", 2.5),
        (NUMBER, "1000000", 1e6),
        (NUMBER, " ", None),
        (TEXT, "  ü\n🙂 ", "ü\n🙂"),
        (TEXT, "x" * LONGEST, "x" * LONGEST),
        (TEXT, "", None),
    ],
)
def test_answers_to_questions(asking, question, text, value):
    filled = asking(question, text)
    assert (filled.values, filled.errors) == ({question.name: value}, {})


@pytest.mark.parametrize(
    ("question", "text", "message"),
    [
        (SCALE, "0", "1 to 5"),
        (SCALE, "6", "1 to 5"),
        (SCALE, "2.5", "1 to 5"),
        (SCALE, "nan", "1 to 5"),
        (SCALE, "five", "1 to 5"),
        (SCALE, "", "Please answer"),
        (CHOICE, "c", "one of the options"),
        (CHOICE, "A", "one of the options"),
        (NUMBER, "-1", "0 to 1,000,000"),
        (NUMBER, "inf", "0 to 1,000,000"),
        (NUMBER, "1e7", "0 to 1,000,000"),
        (TEXT, "x" * (LONGEST + 1), "at most 5,000"),
        (TEXT, "a\x00b", "text"),
    ],
)
def test_what_is_no_answer_to_a_question(asking, question, text, message):
    filled = asking(question, text)
    assert filled.values == {} and message in filled.errors[question.name]


def test_the_questionnaire_is_stored_once_and_ends_the_study(world, baseline):
    world.go_to(baseline, "questions")
    values = {"demanding": 3.0, "group": "one", "comment": None}

    def fill_in():
        with world.database.write() as connection:
            person = find(connection, baseline, to_write=True)
            store_questionnaire(connection, person, world.design, values, world.now)

    results = together(fill_in, fill_in)
    assert sorted(isinstance(each, RefusedError) for each in results) == [False, True]
    (row,) = rows(world.database, schema.participants, number=world.person(baseline).number)
    assert (row["stage"], row["finished_at"]) == ("done", world.now)
    assert row_counts(world.database)["questionnaires"] == 1


def test_where_somebody_is(world, baseline):
    with world.database.read() as connection:
        person = find(connection, baseline)
        assert current_place(connection, person) == world.material.practice
    assert a_choice(person) == {"choice": "left"}
