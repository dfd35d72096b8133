"""The losses of POLITE (Holk, Marta, Leite, ICRA 2024), Eqs. 1 to 6, as pure functions.

Sizes: B queries of a minibatch, m steps of a segment. Everything is differentiable in the rewards.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import torch
from torch import Tensor
from torch.nn.functional import log_softmax, logsigmoid

from polite.types import ShapeError

PreferenceLoss = Callable[[Tensor, Tensor, Tensor], Tensor]
"""(returns of σ₁, of σ₂, μ) → loss; `preference_loss` or another reading of a preference."""


class HighlightLoss(Protocol):
    """(r̂, mask, anchors; L, λ, sign) → loss: one reading of highlights (`highlight_losses`)."""

    def __call__(  # noqa: D102
        self,
        rewards: Tensor,
        mask: Tensor,
        anchors: Tensor,
        *,
        length: int,
        decay: float,
        sign: int,
    ) -> Tensor: ...


def preference_loss(return_1: Tensor, return_2: Tensor, mu: Tensor) -> Tensor:
    """Eq. 2, −Σ_q μ(1) log P[σ₁ ≻ σ₂] + μ(2) log P[σ₂ ≻ σ₁], with P of Eq. 1.

    A sum over the minibatch, not a mean: the paper's α were tuned beside a sum.

    Args:
        return_1: Σ r̂ over the first segments, (B,).
        return_2: Σ r̂ over the second segments, (B,).
        mu: preferences; a row of (0, 0) adds nothing, (B, 2).

    Returns:
        The loss, ().

    Raises:
        ShapeError: if the shapes disagree.
    """
    _check("return_2", return_2, return_1.shape)
    _check("mu", mu, (*return_1.shape, 2))
    difference = return_1 - return_2
    return -(mu[:, 0] * logsigmoid(difference) + mu[:, 1] * logsigmoid(-difference)).sum()


def released_preference_loss(return_1: Tensor, return_2: Tensor, mu: Tensor) -> Tensor:
    """The loss as the authors' public release computes it: softmax over the batch, not the pair.

    Each first segment competes with the other first segments of the minibatch, and each second
    with the other seconds. Rows with μ = (0, 0) take no part. Arguments as `preference_loss`.
    """
    _check("return_2", return_2, return_1.shape)
    _check("mu", mu, (*return_1.shape, 2))
    returns = torch.stack([return_1, return_2], dim=1)
    unrelated = (mu.sum(dim=1) <= 0)[:, None]
    log_shares = log_softmax(returns.masked_fill(unrelated, torch.finfo(returns.dtype).min), dim=0)
    return -(mu * log_shares).sum()


def highlight_return(rewards: Tensor, anchors: Tensor, *, length: int, decay: float) -> Tensor:
    """The inner sum of Eqs. 4 and 5, Σ_{l=0}^{min(j, L)} λ^l r̂(s_{j−l}, a_{j−l}).

    Args:
        rewards: r̂ along the highlighted segments, (B, m).
        anchors: step j at which each highlight ends, −1 for none, (B,) int. That j < m is not
            checked here, where several networks are trained at once: `PreferenceData` does.
        length: L, how many steps a highlight reaches back, so at most L + 1 terms.
        decay: λ, the weight lost with each step back.

    Returns:
        The discounted sums, 0 where there is no highlight, (B,).

    Raises:
        ShapeError: if the shapes disagree.
    """
    if rewards.ndim != 2:
        raise ShapeError(f"rewards: expected (B, m), got {tuple(rewards.shape)}")
    _check("anchors", anchors, rewards.shape[:1])
    steps_back = anchors[:, None] - torch.arange(rewards.shape[1], device=rewards.device)  # (B, m)
    inside = (steps_back >= 0) & (steps_back <= length)
    weights = torch.where(inside, decay ** steps_back.clamp(min=0).to(rewards.dtype), 0.0)
    return (weights * rewards).sum(dim=1)


def highlight_loss(
    rewards: Tensor, anchors: Tensor, *, length: int, decay: float, sign: int
) -> Tensor:
    """Eq. 4 (`sign` = +1) or Eq. 5 (`sign` = −1): the mean over the highlights that are present.

    Args:
        rewards: r̂ along the highlighted segments, (B, m).
        anchors: step at which each highlight ends, −1 for none, (B,) int.
        length: L.
        decay: λ.
        sign: +1 rewards the marked steps, −1 punishes them.

    Returns:
        The loss, exactly 0 if there is no highlight, ().

    Raises:
        ShapeError: if the shapes disagree.
    """
    total = highlight_return(rewards, anchors, length=length, decay=decay).sum()
    return -sign * total / (anchors >= 0).sum().clamp(min=1)


def paper_loss(
    rewards: Tensor, mask: Tensor, anchors: Tensor, *, length: int, decay: float, sign: int
) -> Tensor:
    """`highlight_loss` as a `HighlightLoss`; marks lie on real steps, so it needs no mask."""
    return highlight_loss(rewards, anchors, length=length, decay=decay, sign=sign)


def polite_loss(
    rewards_1: Tensor,
    rewards_2: Tensor,
    mask_1: Tensor,
    mask_2: Tensor,
    mu: Tensor,
    positive: Tensor,
    negative: Tensor,
    *,
    length: int,
    decay: float,
    alpha_positive: float,
    alpha_negative: float,
    preference: PreferenceLoss = preference_loss,
    highlight: HighlightLoss = paper_loss,
    marked: Tensor | None = None,
) -> Tensor:
    """Eq. 6, L = L_pref + α₊ L₊ + α₋ L₋. With both α at 0 this is the preference-only baseline.

    Args:
        rewards_1: r̂ along the first segments, (B, m).
        rewards_2: r̂ along the second segments, (B, m).
        mask_1: True at the real steps of the first segments, (B, m) bool.
        mask_2: True at the real steps of the second segments, (B, m) bool.
        mu: preferences, (B, 2).
        positive: step at which h⁺ ends in the marked segment, −1 for none, (B,) int.
        negative: step at which h⁻ ends in the marked segment, −1 for none, (B,) int.
        length: L.
        decay: λ.
        alpha_positive: α₊.
        alpha_negative: α₋.
        preference: the form of L_pref.
        highlight: the form of L₊ and L₋.
        marked: segment on which the highlights lie, 0 or 1, (B,) int; the preferred one if None.

    Returns:
        The loss, ().

    Raises:
        ShapeError: if the shapes disagree.
    """
    for name, rows in (("rewards_2", rewards_2), ("mask_1", mask_1), ("mask_2", mask_2)):
        _check(name, rows, rewards_1.shape)
    real_1, real_2 = rewards_1.where(mask_1, 0.0), rewards_2.where(mask_2, 0.0)
    loss = preference(real_1.sum(dim=1), real_2.sum(dim=1), mu)
    if not (alpha_positive or alpha_negative):
        return loss
    second = mu[:, 1] > mu[:, 0] if marked is None else marked == 1
    rewards = torch.where(second[:, None], real_2, real_1)
    mask = torch.where(second[:, None], mask_2, mask_1)
    for alpha, anchors, sign in ((alpha_positive, positive, +1), (alpha_negative, negative, -1)):
        if alpha:
            loss = loss + alpha * highlight(
                rewards, mask, anchors, length=length, decay=decay, sign=sign
            )
    return loss


def _check(name: str, tensor: Tensor, shape: tuple[int, ...]) -> None:
    if tuple(tensor.shape) != tuple(shape):
        raise ShapeError(f"{name}: expected {tuple(shape)}, got {tuple(tensor.shape)}")
