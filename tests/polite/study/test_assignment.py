from collections import Counter

from hypothesis import given
from hypothesis import strategies as st

from polite.study.assignment import choose, sequence
from polite.study.design import CONDITIONS, Design, Practice

WORDS = {
    "title": "A study",
    "contact": "ada@example.org",
    "env": "Some-v0",
    "consent": {"version": "1", "text": "Yes."},
    "guide": {
        "text": "Look.",
        "good": {"segment": 0, "start": 0, "text": "good"},
        "bad": {"segment": 1, "start": 0, "text": "bad"},
    },
}


def make_design(**values) -> Design:
    return Design(**(WORDS | values))


def fill(design: Design, people: int) -> list[tuple[str, int]]:
    """The places of people who join one after another; nobody leaves."""
    taken = Counter()
    places = []
    for number in range(1, people + 1):
        places.append(choose(design, number, taken))
        taken[places[-1]] += 1
    return places


@st.composite
def designs(draw):
    comparisons = draw(st.integers(1, 30))
    repeated = draw(st.integers(0, min(5, comparisons)))
    return make_design(
        seed=draw(st.integers(0, 2**32)),
        participants=draw(st.integers(1, 12)),
        comparisons=comparisons,
        repeated=repeated,
        mirrored=draw(st.integers(0, min(5, comparisons - repeated))),
        practice=(Practice(first=0, second=1, expected="first", explanation="x"),)
        * draw(st.integers(0, 3)),
    )


@given(designs(), st.integers(1, 60))
def test_nobody_leaves_so_the_balance_is_exact_at_any_time(design, people):
    sizes = Counter()
    for condition, _ in fill(design, people):
        sizes[condition] += 1
        assert abs(sizes["polite"] - sizes["baseline"]) <= 1


@given(designs())
def test_each_block_comes_once_in_each_condition(design):
    places = fill(design, 2 * design.participants)
    assert sorted(places) == sorted((c, b) for c in CONDITIONS for b in range(design.participants))


@given(designs())
def test_more_people_than_blocks_start_over_in_balance(design):
    counts = Counter(fill(design, 6 * design.participants))
    assert set(counts.values()) == {3}


def test_who_dropped_out_is_replaced_at_their_block():
    design = make_design(participants=3)
    taken = Counter(fill(design, 6))
    taken["baseline", 1] -= 1
    assert choose(design, 7, taken) == ("baseline", 1)


def test_ties_between_conditions_are_broken_by_chance():
    """The first of 400 participants of as many studies: 200 in each condition, give or take 50."""
    first = Counter(choose(make_design(seed=seed), 1, {})[0] for seed in range(400))
    assert abs(first["polite"] - 200) < 50  # five standard deviations


@given(designs(), st.integers(1, 1000), st.data())
def test_a_sequence_is_practice_then_the_block_and_its_catch_pairs(design, number, data):
    block = data.draw(st.integers(0, design.participants - 1))
    trials = sequence(design, number, block)
    kinds = Counter(trial.kind for trial in trials)
    practice = len(design.practice)
    assert [t.kind for t in trials[:practice]] == ["practice"] * practice
    assert [t.query for t in trials[:practice]] == list(range(practice))
    wanted = {
        "practice": practice,
        "main": design.comparisons,
        "repeated": design.repeated,
        "mirrored": design.mirrored,
    }
    assert kinds == Counter({kind: n for kind, n in wanted.items() if n})
    main = sorted(trial.query for trial in trials if trial.kind == "main")
    assert main == list(range(block * design.comparisons, (block + 1) * design.comparisons))


@given(designs(), st.integers(1, 1000))
def test_a_catch_pair_comes_after_its_source_and_not_next_to_it(design, number):
    trials = sequence(design, number, 0)
    sources = {t.query: (place, t) for place, t in enumerate(trials) if t.kind == "main"}
    caught = [(place, t) for place, t in enumerate(trials) if t.kind in ("repeated", "mirrored")]
    assert len({t.query for _, t in caught}) == len(caught)
    # Where there are many, or few to choose from, something has to follow at once.
    roomy = design.comparisons >= 2 * len(caught) + 2
    for place, trial in caught:
        before, source = sources[trial.query]
        assert place > before + roomy
        mirrored = trial.first_is_left != source.first_is_left
        assert mirrored == (trial.kind == "mirrored")


@given(designs(), st.integers(1, 1000))
def test_equal_numbers_give_equal_sequences(design, number):
    assert sequence(design, number, 0) == sequence(design, number, 0)


def test_conditions_see_the_same_comparisons():
    design = make_design(participants=4, comparisons=5)
    seen = {condition: Counter() for condition in CONDITIONS}
    for number, (condition, block) in enumerate(fill(design, 8), 1):
        trials = sequence(design, number, block)
        seen[condition].update(t.query for t in trials if t.kind == "main")
    assert seen["polite"] == seen["baseline"] == Counter(range(20))


def test_participants_of_a_block_see_different_orders_and_sides():
    design = make_design(participants=1, comparisons=20)
    all_trials = [sequence(design, number, 0) for number in range(1, 101)]
    orders = {tuple(t.query for t in trials if t.kind == "main") for trials in all_trials}
    assert len(orders) == 100
    left = [t.first_is_left for trials in all_trials for t in trials if t.kind == "main"]
    assert abs(sum(left) - 1000) < 5 * (2000 * 0.25) ** 0.5


def test_catch_pairs_are_spread():
    """Each of the first half but its last is a source, and each later place holds one, at times."""
    design = make_design(comparisons=10, repeated=1, mirrored=0)
    sources, places = Counter(), Counter()
    for number in range(300):
        trials = sequence(design, number, 0)
        (place,) = (i for i, t in enumerate(trials) if t.kind == "repeated")
        places[place] += 1
        sources[[t.query for t in trials].index(trials[place].query)] += 1
    assert set(sources) == set(range(4)) and set(places) == set(range(5, 11))
    assert min(sources.values()) > 40 and min(places.values()) > 20
