"""Who is asked what: condition, block of comparisons, order, left and right, catch pairs. Pure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from polite.study.design import CONDITIONS, Design, Kind


@dataclass(frozen=True)
class Trial:
    """One comparison as one participant sees it."""

    kind: Kind
    """repeated and mirrored are catch pairs: a main one again, with left and right as they were or
    exchanged."""
    query: int
    """Index in the pool's queries; of practice, in the design's practice."""
    first_is_left: bool
    """Whether the query's first segment is on the left."""


def choose(design: Design, number: int, taken: Mapping[tuple[str, int], int]) -> tuple[str, int]:
    """Condition and block of a new participant, in balance.

    The condition with fewest participants, and in it the first of the blocks with fewest. Ties
    between conditions are broken by chance.

    Args:
        design: The study.
        number: The participant's.
        taken: (condition, block) -> how many who have finished or may still finish.
    """
    rng = np.random.default_rng([design.seed, number, 0])
    sizes = {
        condition: sum(count for (name, _), count in taken.items() if name == condition)
        for condition in CONDITIONS
    }
    fewest = [condition for condition, size in sizes.items() if size == min(sizes.values())]
    condition = fewest[int(rng.integers(len(fewest)))]
    block = min(range(design.participants), key=lambda b: (taken.get((condition, b), 0), b))
    return condition, block


def sequence(design: Design, number: int, block: int) -> list[Trial]:
    """A participant's trials: practice, then the block's comparisons in an order of their own.

    Catch pairs repeat comparisons of the first half but its last, each somewhere in the second
    half, so that another pair comes between in all but the shortest studies.

    Args:
        design: The study.
        number: The participant's; another one sees another order, and other sides.
        block: Which comparisons.
    """
    rng = np.random.default_rng([design.seed, number, 1])
    practice = [Trial("practice", i, bool(rng.integers(2))) for i in range(len(design.practice))]
    queries = block * design.comparisons + rng.permutation(design.comparisons)
    main = [Trial("main", int(query), bool(rng.integers(2))) for query in queries]
    return practice + _with_catch_pairs(main, design, rng)


def _with_catch_pairs(
    main: Sequence[Trial], design: Design, rng: np.random.Generator
) -> list[Trial]:
    kinds: list[Literal["repeated", "mirrored"]] = ["repeated"] * design.repeated
    kinds += ["mirrored"] * design.mirrored
    half = max((len(main) + 1) // 2, len(kinds))
    sources = rng.permutation(max(half - 1, len(kinds)))[: len(kinds)]
    early, late = list(main[:half]), list(main[half:])
    for kind, source in zip(kinds, sources, strict=True):
        seen = main[source]
        again = Trial(kind, seen.query, seen.first_is_left ^ (kind == "mirrored"))
        late.insert(int(rng.integers(len(late) + 1)), again)
    return early + late
