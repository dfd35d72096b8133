"""What a highlight says about r̂: the paper's form, ours, and those that were compared with them.

A teacher marks one window of a segment as its best (sign +1) or worst (−1) moment. Each function is
one reading of that mark, with the same arguments, so that they can stand in for each other:

    rewards  r̂ along the marked segments, (B, m)
    mask     True at their real steps, (B, m) bool
    anchors  step j at which each highlight ends, −1 for none, (B,) int
    length   L, how many steps a window reaches back
    decay    λ, the weight lost with each step back
    sign     +1 for h⁺, −1 for h⁻

and gives a loss of shape (), exactly 0 where nothing is marked; or a ShapeError, where the anchors
are not as many as the rows. All but the paper's are sums over
the highlights, beside Eq. 2's sum over the preferences: both are log-likelihoods or stand for one.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import torch
from torch import Tensor
from torch.nn.functional import log_softmax, logsigmoid, pad

from polite.losses import HighlightLoss, highlight_loss, paper_loss
from polite.types import ShapeError

MARGIN = 1.0
"""By how much the marked window has to exceed its segment's mean, in sums over L + 1 steps."""
TARGET = 0.9
"""What (r̂ + 1) / 2 should be, on average, in a positive window; 1 − this in a negative one."""


def window_means(rewards: Tensor, *, length: int, decay: float) -> Tensor:
    """Ḡ_j = Σ_l λ^l r̂_{j−l} / Σ_l λ^l, l = 0 … min(j, L): the weighted mean of every window.

    A mean, so that windows cut off at the segment's beginning compare with whole ones.

    Args:
        rewards: r̂ along segments, (…, m).
        length: L.
        decay: λ.

    Returns:
        The mean of the window that ends at each step, (…, m).
    """
    weights = decay ** torch.arange(length, -1, -1, dtype=rewards.dtype, device=rewards.device)
    windows = pad(rewards, (length, 0)).unfold(-1, length + 1, 1)  # (…, m, L + 1)
    present = pad(weights.new_ones(rewards.shape[-1]), (length, 0)).unfold(-1, length + 1, 1)
    return (windows @ weights) / (present @ weights)


def choice_loss(
    rewards: Tensor, mask: Tensor, anchors: Tensor, *, length: int, decay: float, sign: int
) -> Tensor:
    """A highlight is a choice among all windows of its segment.

    The teacher could have marked any window and marked this one. Under the model of Eq. 1, in which
    an option is chosen in proportion to exp(return), and with a window standing for m steps like
    it (m also for a segment that was cut short), so that options weigh as much as the segments of a
    query do,

        P[h ends at j | σ] = exp(±m Ḡ_j) / Σ_k exp(±m Ḡ_k),

    Luce's choice rule over the segment's real steps k (Luce 1959; Jeon, Milli and Dragan 2020 read
    any human signal as such a choice). Windows that overlap are almost the same option, which the
    rule does not know, and a mark tells of L + 1 of the m steps; so it is tempered to that share of
    an observation:

        L = −min(1, (L + 1)/m) Σ log P.

    Unlike Eqs. 4 and 5 it compares: it has no gradient on the level of r̂, one that vanishes once
    the mark stands out, and, where the teacher marks relative to the clip, it holds whichever
    segment was labelled the winner.
    """
    steps = rewards.shape[-1]
    logits = sign * steps * window_means(rewards, length=length, decay=decay)
    shares = log_softmax(logits.masked_fill(~mask, -torch.inf), dim=-1)
    return -min(1.0, (length + 1) / steps) * _marked(shares, anchors).sum()


def summed_paper_loss(
    rewards: Tensor, mask: Tensor, anchors: Tensor, *, length: int, decay: float, sign: int
) -> Tensor:
    """Eqs. 4 and 5 as a sum over highlights: the data set the weight, α, instead of a constant."""
    count = (anchors >= 0).sum()
    return count * highlight_loss(rewards, anchors, length=length, decay=decay, sign=sign)


def segment_loss(
    rewards: Tensor, mask: Tensor, anchors: Tensor, *, length: int, decay: float, sign: int
) -> Tensor:
    """The window against its own segment: −Σ log sigmoid(±(L + 1)(Ḡ_j − mean r̂))."""
    losses = -logsigmoid(_lead(rewards, mask, anchors, length, decay, sign))
    return losses.where(anchors >= 0, 0.0).sum()


def margin_loss(
    rewards: Tensor, mask: Tensor, anchors: Tensor, *, length: int, decay: float, sign: int
) -> Tensor:
    """The window exceeds its own segment by a margin: Σ max(0, 1 − (±(L + 1)(Ḡ_j − mean r̂)))."""
    lead = _lead(rewards, mask, anchors, length, decay, sign)
    return (MARGIN - lead).clamp(min=0.0).where(anchors >= 0, 0.0).sum()


def rival_loss(
    rewards: Tensor, mask: Tensor, anchors: Tensor, *, length: int, decay: float, sign: int
) -> Tensor:
    """The window against those of the minibatch's other segments that end at the same step.

    −Σ_i mean_k log sigmoid(±(L + 1)(Ḡ_i,j − Ḡ_k,j)) over the others k that are as long.
    """
    means = (length + 1) * window_means(rewards, length=length, decay=decay)
    ends = anchors.clamp(min=0)
    marked = _marked(means, ends)
    others = ~torch.eye(len(anchors), dtype=torch.bool, device=anchors.device)
    rivals, real = means[:, ends].T, mask[:, ends].T & others  # (B, B): row i, the others at j_i
    leads = logsigmoid(sign * (marked[:, None] - rivals)).where(real, 0.0)
    mean = leads.sum(dim=1) / real.sum(dim=1).clamp(min=1)
    return -mean.where(anchors >= 0, 0.0).sum()


def choice_and_rival_loss(
    rewards: Tensor, mask: Tensor, anchors: Tensor, *, length: int, decay: float, sign: int
) -> Tensor:
    """`choice_loss`, which compares within a segment, and `rival_loss`, which compares across."""
    within = choice_loss(rewards, mask, anchors, length=length, decay=decay, sign=sign)
    return within + rival_loss(rewards, mask, anchors, length=length, decay=decay, sign=sign)


def target_loss(
    rewards: Tensor, mask: Tensor, anchors: Tensor, *, length: int, decay: float, sign: int
) -> Tensor:
    """A soft target: the cross-entropy of (Ḡ_j + 1) / 2 with .9, or .1 for h⁻; for r̂ in (−1, 1)."""
    means = _marked(window_means(rewards, length=length, decay=decay), anchors.clamp(min=0))
    level = ((sign * means + 1) / 2).clamp(1e-6, 1 - 1e-6)
    losses = -(TARGET * level.log() + (1 - TARGET) * (1 - level).log())
    return losses.where(anchors >= 0, 0.0).sum()


HIGHLIGHT_LOSSES: Final[Mapping[str, HighlightLoss]] = {
    "choice": choice_loss,
    "paper": paper_loss,
    "paper-summed": summed_paper_loss,
    "segment": segment_loss,
    "margin": margin_loss,
    "rival": rival_loss,
    "choice-rival": choice_and_rival_loss,
    "target": target_loss,
}
"""By the name that configurations use."""


def _marked(values: Tensor, anchors: Tensor) -> Tensor:
    """The entry at each row's anchor, 0 where there is none, (B,).

    Raises:
        ShapeError: unless there is an anchor for each row.
    """
    if anchors.shape != values.shape[:-1]:
        raise ShapeError(
            f"anchors: expected {tuple(values.shape[:-1])}, got {tuple(anchors.shape)}"
        )
    found = values.gather(-1, anchors.clamp(min=0)[..., None])[..., 0]
    return found.where(anchors >= 0, 0.0)


def _lead(
    rewards: Tensor, mask: Tensor, anchors: Tensor, length: int, decay: float, sign: int
) -> Tensor:
    """±(L + 1)(Ḡ_j − mean r̂ of the segment), (B,)."""
    mean = rewards.where(mask, 0.0).sum(dim=-1) / mask.sum(dim=-1)
    marked = _marked(window_means(rewards, length=length, decay=decay), anchors)
    return sign * (length + 1) * (marked - mean)
