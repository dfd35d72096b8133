"""Several reward networks with stacked weights: one batched pass trains or scores them all."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn.functional import leaky_relu

from polite.rewards.data import PreferenceData, split_answers
from polite.rewards.dropout import dropout
from polite.rewards.network import RewardNet
from polite.rewards.stopping import EarlyStop
from polite.rewards.trainer import (
    RewardTrainingConfig,
    batch_loss,
    make_optimiser,
    minibatches,
    validation_loss,
)
from polite.types import Floats64, InvalidValueError, Query, SegmentPool

_SEGMENTS_AT_ONCE = 64


class RewardEnsemble(nn.Module):
    """K reward networks of one shape, their weights stacked along a leading axis."""

    mean: Tensor
    std: Tensor

    def __init__(self, members: Sequence[RewardNet]) -> None:
        """Stack networks; their weights are copied, the first one's input statistics serve all.

        Args:
            members: K networks of the same shape.

        Raises:
            InvalidValueError: if there is none, or they differ in shape.
        """
        super().__init__()
        shapes = {(m.observation_size, m.action_size, m.config) for m in members}
        if len(shapes) != 1:
            raise InvalidValueError(
                f"expected members of one shape, got {sorted(map(str, shapes))}"
            )
        (self.shape,) = shapes
        states = [member.state_dict() for member in members]
        layers = range(len(members[0].layers))
        self.weights = nn.ParameterList(
            torch.stack([state[f"layers.{i}.weight"].T for state in states]) for i in layers
        )  # (K, inputs, outputs) each
        self.biases = nn.ParameterList(
            torch.stack([state[f"layers.{i}.bias"][None] for state in states]) for i in layers
        )  # (K, 1, outputs) each
        self.register_buffer("mean", states[0]["mean"].clone())
        self.register_buffer("std", states[0]["std"].clone())

    def __len__(self) -> int:
        """The number of members K."""
        return len(self.weights[0])

    def forward(self, inputs: Tensor, generator: torch.Generator | None = None) -> Tensor:
        """Score raw (s, a) with every member.

        Args:
            inputs: what each member sees, (K, …, n + v).
            generator: source of the dropout masks; without one nothing is dropped.

        Returns:
            r̂ in (−1, 1), (K, …).
        """
        features = ((inputs - self.mean) / self.std).flatten(1, -2)  # (K, rows, n + v)
        *_, config = self.shape
        for weight, bias, probability in zip(
            self.weights, self.biases, (*config.dropout, None), strict=True
        ):
            features = torch.baddbmm(bias, features, weight)
            if probability is not None:  # a hidden layer
                features = leaky_relu(features, inplace=True)
                if generator is not None:
                    features = dropout(features, probability, generator)
        return torch.tanh(features).view(inputs.shape[:-1])

    def score(self, inputs: Tensor) -> Tensor:
        """Score the same raw (s, a), (…, n + v), with every member, (K, …), without dropout."""
        return self(inputs.expand(len(self), *inputs.shape))  # type: ignore[no-any-return]

    def member(self, index: int) -> RewardNet:
        """A copy of one member as a network of its own."""
        net = RewardNet(*self.shape, torch.Generator())
        state = {"mean": self.mean, "std": self.std}
        for i, (weight, bias) in enumerate(zip(self.weights, self.biases, strict=True)):
            state |= {f"layers.{i}.weight": weight[index].T, f"layers.{i}.bias": bias[index, 0]}
        net.load_state_dict(state)
        return net


def train_ensemble(
    ensemble: RewardEnsemble,
    data: PreferenceData,
    config: RewardTrainingConfig,
    generator: torch.Generator,
) -> None:
    """Fit all members in place, each on all answers in an order of its own (as PEBBLE does).

    Args:
        ensemble: the members.
        data: the answers.
        config: how to train.
        generator: source of the batch orders and the dropout masks.
    """
    data, held_out = split_answers(data, config.validation_share, generator)
    optimiser = make_optimiser(ensemble, config)  # works entry by entry, so members stay apart
    stop = EarlyStop(ensemble, config.stop_accuracy, config.patience)
    for _ in range(config.epochs):
        orders = [
            minibatches(len(data), config.batch_size, generator) for _ in range(len(ensemble))
        ]
        for batches in zip(*orders, strict=True):
            chosen = torch.stack(batches)  # (K, B)
            segments = data.pairs[chosen]  # (K, B, 2)
            rewards = ensemble(data.inputs[segments], generator)  # (K, B, 2, m)
            losses = [
                batch_loss(own, data, batch, config)
                for own, batch in zip(rewards, batches, strict=True)
            ]
            optimiser.zero_grad()
            torch.stack(losses).sum().backward()  # type: ignore[no-untyped-call]
            optimiser.step()
            stop.count(rewards, data.mask[segments], data.mu[chosen])
        if stop.after_epoch(validation_loss(ensemble.score, held_out, config)):
            break
    stop.keep_best()


def member_probabilities(
    ensemble: RewardEnsemble, pool: SegmentPool, queries: Sequence[Query]
) -> Floats64:
    """P[σ₁ ≻ σ₂] (POLITE, Eq. 1) of each query as each member sees it, (K, Q)."""
    inputs = torch.from_numpy(np.concatenate([pool.observations, pool.actions], axis=-1))
    with torch.no_grad():
        rewards = torch.cat(
            [
                ensemble.score(inputs[rows])
                for rows in torch.split(torch.arange(len(pool)), _SEGMENTS_AT_ONCE)
            ],
            dim=1,
        )  # (K, S, m)
    returns = rewards.where(torch.from_numpy(pool.mask), 0.0).sum(dim=2)
    first, second = torch.tensor([(query.first, query.second) for query in queries]).T
    probabilities = torch.sigmoid(returns[:, first] - returns[:, second])
    return np.asarray(probabilities.numpy(), dtype=np.float64)
