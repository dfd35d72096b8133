"""Catch pairs, haste and exclusion, worked out by hand."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_up_study import answer, consistent, made_up_design, person, trial

from polite.study.design import Exclusion
from polite.study.quality import (
    FAILED_CATCH_PAIRS,
    NOT_FINISHED,
    SAME_CHOICE,
    TOO_FAST,
    answered,
    catch_results,
    choice_seconds,
    decision_seconds,
    exclusion,
    fast_share,
    left_rate,
    same_choice_share,
)
from polite.study.records import RecordsError, said

CHOICES = ("left", "right", "equal", "incomparable")


@pytest.fixture
def design(tmp_path):
    return made_up_design(tmp_path)


def with_rules(design, **rules):
    return design.model_copy(update={"exclusion": Exclusion(**rules)})


def outcomes(*answers):
    return {result.kind: result.outcome for result in catch_results(person(1, *answers))}


def test_a_repeated_pair_must_get_the_same_side_and_a_mirrored_one_the_other():
    agreed = outcomes(answer(1, "left"), answer(3, "left"), answer(2, "left"), answer(4, "right"))
    assert agreed == {"repeated": "agreed", "mirrored": "agreed"}
    failed = outcomes(answer(1, "left"), answer(3, "right"), answer(2, "left"), answer(4, "left"))
    assert failed == {"repeated": "contradicted", "mirrored": "contradicted"}


@pytest.mark.parametrize(
    ("before", "again", "outcome"),
    [
        ("equal", "equal", "agreed"),
        ("incomparable", "incomparable", "agreed"),
        ("equal", "left", "undecided"),
        ("right", "incomparable", "undecided"),
        ("equal", "incomparable", "undecided"),
    ],
)
def test_no_preference_contradicts_nothing(before, again, outcome):
    assert outcomes(answer(1, before), answer(3, again))["repeated"] == outcome


def test_a_pair_that_was_not_answered_twice_has_no_result():
    assert outcomes(answer(3, "left")) == {"repeated": "unanswered", "mirrored": "unanswered"}


def test_the_last_revision_counts():
    changed = [answer(3, "right"), answer(3, "left", revision=2)]
    for order in (changed, changed[::-1]):
        assert outcomes(answer(1, "left"), *order)["repeated"] == "agreed"


@given(st.sampled_from(CHOICES), st.sampled_from(CHOICES), st.booleans(), st.booleans())
def test_exchanging_the_sides_of_both_comparisons_changes_no_outcome(first, again, left, mirrored):
    def result(flip):
        swap = {"left": "right", "right": "left"} if flip else {}
        trials = (
            trial(0, "main", 7, left ^ flip),
            trial(1, "mirrored" if mirrored else "repeated", 7, left ^ flip ^ mirrored),
        )
        answers = (answer(0, swap.get(first, first)), answer(1, swap.get(again, again)))
        return catch_results(person(1, *answers, trials=trials))[0].outcome

    assert result(False) == result(True)


def test_decisions_are_timed_by_the_page_if_that_can_be():
    assert decision_seconds(answer(1, client_watched_at=10.0, client_answered_at=13.0)) == 3.0
    assert decision_seconds(answer(1, client_watched_at=10.0, client_answered_at=9.0)) == 5.0
    assert decision_seconds(answer(1, client_watched_at=10.0, client_answered_at=99.0)) == 5.0
    assert decision_seconds(answer(1, client_watched_at=None)) == 5.0
    assert decision_seconds(answer(1, client_watched_at=None, watched_at=None)) is None
    assert decision_seconds(answer(1, received_at=5.0)) is None


def test_choices_are_timed_as_decisions_are_but_without_marking():
    marking = {"client_watched_at": 10.0, "client_answered_at": 18.0}
    marked = answer(1, **marking, client_chosen_at=11.0)
    assert (choice_seconds(marked), decision_seconds(marked)) == (1.0, 8.0)
    for impossible in (9.0, 99.0, None):
        assert choice_seconds(answer(1, **marking, client_chosen_at=impossible)) == 5.0
    assert choice_seconds(answer(1, client_watched_at=None)) == 5.0
    assert choice_seconds(answer(1, client_watched_at=None, watched_at=None)) is None
    assert choice_seconds(answer(1, received_at=5.0)) is None


def hasty(place, choice="left", marking=0.0):
    chosen_at = 1015.5 + 100.0 * place
    return answer(place, choice, client_chosen_at=chosen_at, client_answered_at=chosen_at + marking)


def test_equal_haste_excludes_in_both_conditions(design):
    """Marking passages takes time, and only one condition is asked for it."""
    asked = {"baseline": 0.0, "polite": 4.0}
    for condition, marking in asked.items():
        quick = [hasty(place, marking=marking) for place in (1, 2)]
        assert exclusion(person(1, *quick, condition=condition), design) == (TOO_FAST,)


def test_share_of_fast_answers_leaves_out_practice(design):
    someone = person(1, hasty(0), hasty(1), answer(2), answer(3), answer(4))
    assert fast_share(someone, design) == 0.25
    assert fast_share(person(1, hasty(0)), design) is None
    unknown = answer(2, client_watched_at=None, watched_at=None)
    assert fast_share(person(1, hasty(1), unknown), design) == 1.0


def test_a_quick_change_of_mind_is_no_haste(design):
    """The clips were watched before, and the page's clock begins anew when it is reopened."""
    changed = answer(1, "right", revision=2, client_watched_at=2000.0, client_answered_at=2000.5)
    later = replace(changed, client_chosen_at=2000.5, received_at=2001.0)
    assert fast_share(person(1, answer(1), later), design) == 0.0
    slow = replace(later, client_chosen_at=2090.0, client_answered_at=2090.0)
    assert fast_share(person(1, hasty(1), slow), design) == 1.0


def test_left_rate_is_of_expressed_preferences():
    assert left_rate(person(1, answer(1), answer(2), answer(3, "right"), answer(5, "equal"))) == (
        pytest.approx(2 / 3)
    )
    assert left_rate(person(1, answer(1, "equal"))) is None


def test_reasons_of_exclusion(design):
    assert exclusion(consistent(1), design) == ()
    assert exclusion(replace(consistent(1), finished_at=None), design) == (NOT_FINISHED,)
    wrong = (answer(1, "left"), answer(2, "left"), answer(3, "right"), answer(4, "left"))
    assert exclusion(person(1, *wrong), design) == (FAILED_CATCH_PAIRS,)
    assert exclusion(person(1, *wrong[:3]), design) == ()  # one contradiction is allowed
    strict = with_rules(design, failed_catch_pairs=1)
    assert exclusion(person(1, *wrong[:3]), strict) == (FAILED_CATCH_PAIRS,)


def test_too_fast_begins_at_the_share_that_the_design_names(design):
    half = person(1, hasty(1), answer(2))
    assert exclusion(half, design) == (TOO_FAST,)
    assert exclusion(half, with_rules(design, fast_share=0.51)) == ()
    assert exclusion(half, with_rules(design, fast_seconds=0.5)) == ()
    all_wrong = person(1, hasty(1), hasty(2), hasty(3, "right"), hasty(4), finished_at=None)
    assert exclusion(all_wrong, design) == (NOT_FINISHED, FAILED_CATCH_PAIRS, TOO_FAST)


def chooses(*choices, more=(), **values):
    """Somebody whose main comparisons, all of different segments, were answered so."""
    trials = tuple(trial(i, "main", i, bool(i % 2)) for i in range(len(choices)))
    answers = [answer(place, choice) for place, choice in enumerate(choices)]
    return person(1, *answers, *more, trials=trials, **values)


@pytest.mark.parametrize("choice", CHOICES)
def test_who_always_says_the_same_is_excluded(design, choice):
    assert exclusion(chooses(*[choice] * 8), design) == (SAME_CHOICE,)
    assert exclusion(chooses(*[choice] * 7), design) == ()  # too few to tell
    other = "left" if choice == "right" else "right"
    assert exclusion(chooses(*[choice] * 19, other), design) == ()


def test_one_choice_is_counted_as_it_was_shown(design):
    """Both clips of a pair stand left as often: the same segment each time is no straight line."""
    same_segment = ["left" if i % 2 else "right" for i in range(8)]
    assert same_choice_share(chooses(*same_segment)) == 0.5
    assert exclusion(chooses(*same_segment), design) == ()


def test_share_of_the_most_frequent_choice():
    assert same_choice_share(chooses("equal", "left", "equal", "equal")) == 0.75
    assert same_choice_share(chooses("left", "right", "equal", "incomparable")) == 0.25
    assert same_choice_share(person(1, answer(0), finished_at=None)) is None  # practice only
    # Of the main ones at 1, 2 and 5 only, whatever the catch pairs at 3 and 4 say.
    mixed = person(1, answer(1), answer(2), answer(3, "equal"), answer(4, "equal"))
    assert same_choice_share(mixed) == 1.0
    changed = answer(0, "right", revision=2)
    assert same_choice_share(chooses("left", "left", more=(changed,))) == 0.5


def test_same_choice_begins_where_the_design_says(design):
    nine_of_ten = chooses(*["equal"] * 9, "left")
    assert exclusion(nine_of_ten, with_rules(design, same_choice_share=0.9)) == (SAME_CHOICE,)
    assert exclusion(nine_of_ten, with_rules(design, same_choice_share=0.91)) == ()
    all_equal = chooses(*["equal"] * 10)
    assert exclusion(all_equal, with_rules(design, same_choice_answers=10)) == (SAME_CHOICE,)
    assert exclusion(all_equal, with_rules(design, same_choice_answers=11)) == ()


@given(st.lists(st.sampled_from(CHOICES), min_size=1, max_size=20))
def test_a_share_of_one_choice_is_at_least_a_quarter(choices):
    share = same_choice_share(chooses(*choices))
    assert 0.25 <= share <= 1.0
    assert (share == 1.0) == (len(set(choices)) == 1)


def test_an_answer_without_a_trial_is_named():
    with pytest.raises(RecordsError, match=r"participant 4.*place 9"):
        answered(person(4, answer(9)))


@given(st.sampled_from(CHOICES), st.booleans())
def test_what_is_said_does_not_depend_on_where_it_stood(choice, left):
    other = {"left": "right", "right": "left"}.get(choice, choice)
    assert said(trial(0, "main", 0, left), choice) == said(trial(0, "main", 0, not left), other)
