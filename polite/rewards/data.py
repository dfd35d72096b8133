"""Answers as tensors, stacked once before training."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor

from polite.dataset import Feedback
from polite.types import Highlight, InvalidValueError, ShapeError


@dataclass(frozen=True, eq=False)
class PreferenceData:
    """Q answers about pairs of S segments of m steps."""

    inputs: Tensor
    """Raw observations and actions side by side, (S, m, n + v) float32."""
    mask: Tensor
    """True at real steps, (S, m) bool."""
    pairs: Tensor
    """The two segments of each answered query, (Q, 2) int64."""
    mu: Tensor
    """Preferences, (Q, 2) float32."""
    positive: Tensor
    """Step at which h⁺ ends, −1 for none, (Q,) int64."""
    negative: Tensor
    """Step at which h⁻ ends, −1 for none, (Q,) int64."""
    marked: Tensor
    """Segment of the pair on which the highlights lie, 0 or 1, (Q,) int64."""

    def __post_init__(self) -> None:
        """Check the tensors against each other.

        Raises:
            ShapeError: if they disagree on Q, S or m.
            InvalidValueError: if a pair is not in the pool or an anchor not in its segment.
        """
        segments, answers = self.inputs.shape[:2], len(self.pairs)
        for name, tensor, shape in (
            ("mask", self.mask, segments),
            ("pairs", self.pairs, (answers, 2)),
            ("mu", self.mu, (answers, 2)),
            ("positive", self.positive, (answers,)),
            ("negative", self.negative, (answers,)),
            ("marked", self.marked, (answers,)),
        ):
            if tuple(tensor.shape) != tuple(shape):
                raise ShapeError(f"{name}: expected {tuple(shape)}, got {tuple(tensor.shape)}")
        if answers == 0:
            raise ShapeError("pairs: expected at least one answer, got none")
        if self.pairs.min() < 0 or self.pairs.max() >= len(self.inputs):
            raise InvalidValueError(f"pairs: expected indices 0 … {len(self.inputs) - 1}")
        lengths = self.mask.sum(dim=1)[self.pairs[torch.arange(answers), self.marked]]
        for name, anchors in (("positive", self.positive), ("negative", self.negative)):
            if (anchors < -1).any() or (anchors >= lengths).any():
                raise InvalidValueError(f"{name}: expected −1 or a real step of the marked segment")

    def __len__(self) -> int:
        """The number of answers Q."""
        return len(self.pairs)

    def without_preferences(self) -> PreferenceData:
        """The same answers with μ = (0, 0), which adds nothing to Eq. 2: the highlights remain."""
        return replace(self, mu=torch.zeros_like(self.mu))

    def take(self, answers: Tensor) -> PreferenceData:
        """Some of the answers, by their index, (A,) int64; the segments are shared."""
        names = ("pairs", "mu", "positive", "negative", "marked")
        return replace(self, **{name: getattr(self, name)[answers] for name in names})


def stack_feedback(feedback: Feedback) -> PreferenceData:
    """Stack answers, their queries and the segments for training.

    Raises:
        ShapeError: if there is no answer.
    """
    pool, answers = feedback.pool, feedback.answers
    asked = [feedback.queries[answer.query] for answer in answers]
    inputs = np.concatenate([pool.observations, pool.actions], axis=-1)
    return PreferenceData(
        inputs=torch.from_numpy(inputs),
        mask=torch.from_numpy(pool.mask),
        pairs=torch.tensor([(q.first, q.second) for q in asked], dtype=torch.int64).view(-1, 2),
        mu=torch.tensor([answer.preference for answer in answers]).view(-1, 2),
        positive=_anchors([answer.positive for answer in answers]),
        negative=_anchors([answer.negative for answer in answers]),
        marked=torch.tensor([answer.marked or 0 for answer in answers], dtype=torch.int64),
    )


def split_answers(
    data: PreferenceData, share: float
) -> tuple[PreferenceData, PreferenceData | None]:
    """Hold out a share of the answers, spread evenly over their order.

    Which ones follows from their places alone: where answers are only ever appended, those that
    were held out once stay so, and a model that is trained on has never seen them.

    Args:
        data: the answers.
        share: how many are held out, rounded down; in [0, 1).

    Returns:
        The answers to train on and those held out, None if there are none.
    """
    so_far = torch.floor(share * torch.arange(len(data) + 1, dtype=torch.float64))
    held_out = so_far.diff() > 0  # never the first one
    if not held_out.any():
        return data, None
    return data.take((~held_out).nonzero()[:, 0]), data.take(held_out.nonzero()[:, 0])


def segments_of(inputs: Tensor, chosen: Tensor) -> Tensor:
    """`inputs[chosen]`, (S, m, n), (…) -> (…, m, n), copied by the segment, not by the entry."""
    return inputs.index_select(0, chosen.flatten()).view(*chosen.shape, *inputs.shape[1:])


def _anchors(highlights: Sequence[Highlight | None]) -> Tensor:
    return torch.tensor([-1 if h is None else h.end for h in highlights], dtype=torch.int64)
