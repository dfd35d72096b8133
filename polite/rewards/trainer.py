"""Training a reward model on answers (POLITE, Eq. 6), all pairs of a minibatch at once."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from math import ceil
from typing import Literal

import torch
from torch import Tensor

from polite.highlight_losses import HIGHLIGHT_LOSSES
from polite.losses import polite_loss, preference_loss, released_preference_loss
from polite.rewards.data import PreferenceData, segments_of, split_answers
from polite.rewards.heap import keep_freed_memory
from polite.rewards.network import RewardNet
from polite.rewards.stopping import EarlyStop
from polite.types import InvalidValueError

_PREFERENCE_LOSSES = {"pairwise": preference_loss, "released": released_preference_loss}


LEAST_HELD_OUT = 10
"""Held-out answers that have to say something before a training is stopped by them."""


@dataclass(frozen=True)
class RewardTrainingConfig:
    """How a reward model is trained."""

    epochs: int = 100
    """Passes over all answers, at most."""
    batch_size: int = 128
    """Most answers of a minibatch; the minibatches of an epoch are of equal size, give or take one.
    A hyper-parameter, since preferences are summed over it and highlights averaged."""
    learning_rate: float = 3e-4
    """Adam's step size."""
    weight_decay: float = 0.0
    """Adam's L2 penalty."""
    highlight_length: int = 10
    """L, how many steps a highlight reaches back."""
    highlight_decay: float = 0.7
    """λ, the weight that a highlight loses with each step back."""
    alpha_positive: float = 10.0
    """α₊, weight of positive highlights; 0 leaves them out. 10 is the paper's; the other forms of
    `highlights` are meant for 1."""
    alpha_negative: float = 10.0
    """α₋, weight of negative highlights; 0 leaves them out."""
    preference: Literal["pairwise", "released"] = "pairwise"
    """Form of L_pref: Eq. 2, or the batch softmax of the authors' release."""
    highlights: str = "paper"
    """Form of L₊ and L₋, a name in `polite.highlight_losses.HIGHLIGHT_LOSSES`."""
    stop_accuracy: float | None = None
    """Stop after an epoch in which r̂ put more than this share of the expressed preferences in the
    order of their labels (PEBBLE: .97), counted as the minibatches pass; None never stops so."""
    validation_share: float = 0.0
    """Share of the answers that is held out: the training stops when their L_pref falls no more,
    and the weights of its best epoch are kept. 0 holds nothing out."""
    patience: int = 10
    """For how many epochs in a row it may fail to fall."""
    bootstrap: bool = False
    """Whether each member of an ensemble learns from answers of its own, as many as there are,
    drawn with replacement for each training (Christiano et al. 2017), or all from all (PEBBLE)."""

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            InvalidValueError: naming the setting that is outside of its range.
        """
        least = dict.fromkeys(("epochs", "batch_size", "patience"), 1) | dict.fromkeys(
            ("weight_decay", "highlight_length", "alpha_positive", "alpha_negative"), 0
        )
        ranges = {
            name: (f"at least {low}", getattr(self, name) >= low) for name, low in least.items()
        }
        ranges |= {
            "learning_rate": ("above 0", self.learning_rate > 0),
            "highlight_decay": ("in [0, 1]", 0 <= self.highlight_decay <= 1),
            "validation_share": ("in [0, 1)", 0 <= self.validation_share < 1),
            "stop_accuracy": (
                "in (0, 1) or None",
                self.stop_accuracy is None or 0 < self.stop_accuracy < 1,
            ),
        }
        for name, (expected, fits) in ranges.items():
            if not fits:
                raise InvalidValueError(f"{name}: expected {expected}, got {getattr(self, name)}")
        for name, known in (("preference", _PREFERENCE_LOSSES), ("highlights", HIGHLIGHT_LOSSES)):
            if getattr(self, name) not in known:
                forms = ", ".join(known)
                raise InvalidValueError(
                    f"{name}: expected one of {forms}, got {getattr(self, name)!r}"
                )

    def without_highlights(self) -> RewardTrainingConfig:
        """The same with both α at 0: preferences alone."""
        return replace(self, alpha_positive=0.0, alpha_negative=0.0)


def train_reward(
    net: RewardNet,
    data: PreferenceData,
    config: RewardTrainingConfig,
    generator: torch.Generator,
    on_epoch: Callable[[int, RewardNet], object] | None = None,
) -> None:
    """Fit the net to the answers, in place. With both α at 0 this is the preference-only baseline.

    Args:
        net: the reward model, changed in place.
        data: the answers.
        config: how to train.
        generator: source of the batch orders and the dropout masks.
        on_epoch: called after each epoch with its number, from 1, and the net.
    """
    keep_freed_memory()
    data, held_out = split_answers(data, config.validation_share)
    inputs = net.scaled(data.inputs)
    optimiser = make_optimiser(net, config)
    stop = EarlyStop(net, config.stop_accuracy, config.patience)
    stop.after_epoch(validation_loss(net, held_out, config))  # the weights it begins with count too
    for epoch in range(1, config.epochs + 1):
        for batch in minibatches(len(data), config.batch_size, generator):
            segments = data.pairs[batch]
            rewards = net.score_scaled(segments_of(inputs, segments), generator)  # (B, 2, m)
            optimiser.zero_grad()
            batch_loss(rewards, data, batch, config).backward()  # type: ignore[no-untyped-call]
            optimiser.step()
            stop.count(rewards, data.mask[segments], data.mu[batch])
        if on_epoch is not None:
            on_epoch(epoch, net)
        if stop.after_epoch(validation_loss(net, held_out, config)):
            break
    stop.keep_best()


def make_optimiser(module: torch.nn.Module, config: RewardTrainingConfig) -> torch.optim.Adam:
    """Adam with the config's step size and weight decay."""
    return torch.optim.Adam(
        module.parameters(), lr=config.learning_rate, weight_decay=config.weight_decay, fused=True
    )


def minibatches(count: int, batch_size: int, generator: torch.Generator) -> Iterator[Tensor]:
    """Shuffle 0 … count − 1 and split it into parts of equal size, give or take one."""
    order = torch.randperm(count, generator=generator)
    yield from order.tensor_split(updates_per_epoch(count, batch_size))


def updates_per_epoch(count: int, batch_size: int) -> int:
    """Minibatches, and so gradient updates, of one pass over so many answers."""
    return ceil(count / batch_size)


def batch_loss(
    rewards: Tensor, data: PreferenceData, batch: Tensor, config: RewardTrainingConfig
) -> Tensor:
    """POLITE's Eq. 6 over one minibatch.

    Args:
        rewards: r̂ along both segments of each answer, (B, 2, m).
        data: all answers.
        batch: which of them this minibatch holds, (B,).
        config: α, λ, L and the form of L_pref.

    Returns:
        The loss, ().
    """
    mask = data.mask[data.pairs[batch]]
    return polite_loss(
        rewards[:, 0],
        rewards[:, 1],
        mask[:, 0],
        mask[:, 1],
        data.mu[batch],
        data.positive[batch],
        data.negative[batch],
        length=config.highlight_length,
        decay=config.highlight_decay,
        alpha_positive=config.alpha_positive,
        alpha_negative=config.alpha_negative,
        preference=_PREFERENCE_LOSSES[config.preference],
        highlight=HIGHLIGHT_LOSSES[config.highlights],
        marked=data.marked[batch],
    )


def validation_loss(
    score: Callable[[Tensor], Tensor], held_out: PreferenceData | None, config: RewardTrainingConfig
) -> float | None:
    """L_pref of the held-out answers, mean over members; None where it would be mostly chance.

    That is where fewer than `LEAST_HELD_OUT` of them say anything.

    Args:
        score: (s, a) of the answers' pairs, (Q, 2, m, n + v), to r̂ without dropout, (…, Q, 2, m).
        held_out: the answers, if any are held out.
        config: the form of L_pref.
    """
    if held_out is None or int(held_out.mu.any(dim=-1).sum()) < LEAST_HELD_OUT:
        return None
    with torch.no_grad():
        rewards = score(held_out.inputs[held_out.pairs])
        returns = rewards.where(held_out.mask[held_out.pairs], 0.0).sum(dim=-1)
        members = returns.reshape(-1, *returns.shape[-2:])  # (K, Q, 2)
        loss = _PREFERENCE_LOSSES[config.preference]
        losses = [loss(own[:, 0], own[:, 1], held_out.mu).item() for own in members]
    return sum(losses) / len(losses)
