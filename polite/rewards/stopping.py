"""When a reward model's training ends before its last epoch."""

from __future__ import annotations

from math import inf

import torch
from torch import Tensor, nn


class EarlyStop:
    """Watches a training: ends it once the answers are learned, or no longer learned."""

    def __init__(self, module: nn.Module, accuracy: float | None, patience: int) -> None:
        """Begin to watch.

        Args:
            module: what is trained.
            accuracy: end after an epoch with a larger share of pairs in order; None for never.
            patience: end when the held-out loss has not fallen for so many epochs.
        """
        self._module, self._accuracy, self._patience = module, accuracy, patience
        self._in_order = self._expressed = 0
        self._least, self._waited = inf, 0
        self._best: dict[str, Tensor] | None = None

    def count(self, rewards: Tensor, mask: Tensor, mu: Tensor) -> None:
        """Count the pairs of a minibatch that r̂ orders as they are labelled.

        An ensemble's members are counted together, so that their mean accuracy decides (as in the
        released code of B-Pref).

        Args:
            rewards: r̂ along both segments, (…, B, 2, m).
            mask: True at their real steps, (…, B, 2, m).
            mu: preferences; those that express none are not counted, (…, B, 2).
        """
        if self._accuracy is None:
            return
        returns = rewards.detach().where(mask, 0.0).sum(dim=-1)
        labels = torch.sign(mu[..., 0] - mu[..., 1])
        order = torch.sign(returns[..., 0] - returns[..., 1])
        expressed = labels != 0
        self._in_order += int(((order == labels) & expressed).sum())
        self._expressed += int(expressed.sum())

    def after_epoch(self, held_out_loss: float | None) -> bool:
        """Whether the training is over; a new epoch's count begins.

        Args:
            held_out_loss: of the held-out answers; None if they say nothing.
        """
        learned = self._accuracy is not None and self._in_order > self._accuracy * self._expressed
        self._in_order = self._expressed = 0
        if held_out_loss is not None:
            self._compare(held_out_loss)
        return learned or self._waited >= self._patience

    def keep_best(self) -> None:
        """Put back the weights of the epoch with the least held-out loss, if any was told."""
        if self._best is not None:
            self._module.load_state_dict(self._best)

    def _compare(self, loss: float) -> None:
        if loss < self._least:
            self._least, self._waited = loss, 0
            self._best = {name: row.clone() for name, row in self._module.state_dict().items()}
        else:
            self._waited += 1
