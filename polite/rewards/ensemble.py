"""Several reward networks with stacked weights: one batched pass trains or scores them all."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn.functional import leaky_relu

from polite.rewards.blocks import in_blocks
from polite.rewards.data import PreferenceData, segments_of, split_answers
from polite.rewards.dropout import dropout
from polite.rewards.heap import keep_freed_memory
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


class RewardEnsemble(nn.Module):
    """K reward networks of one shape, their weights stacked along a leading axis."""

    mean: Tensor
    std: Tensor
    level: Tensor
    scale: Tensor

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
        self.observation_size, self.action_size, self.config = self.shape
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
        self.register_buffer("level", torch.cat([state["level"] for state in states]))  # (K,)
        self.register_buffer("scale", torch.cat([state["scale"] for state in states]))

    def __len__(self) -> int:
        """The number of members K."""
        return len(self.weights[0])

    def forward(self, inputs: Tensor, generator: torch.Generator | None = None) -> Tensor:
        """Score raw (s, a) with every member.

        Args:
            inputs: what each member sees, (K, …, n + v).
            generator: source of the dropout masks; without one nothing is dropped.

        Returns:
            r̂, in (−1, 1) unless the output is linear, (K, …).
        """
        return self.score_scaled(self.scaled(inputs), generator)

    def scaled(self, inputs: Tensor) -> Tensor:
        """Raw (s, a) with the input statistics taken out, (…, n + v)."""
        return (inputs - self.mean) / self.std

    def score_scaled(self, inputs: Tensor, generator: torch.Generator | None = None) -> Tensor:
        """Score what `scaled` gave, as `RewardNet.score_scaled`."""
        rows = inputs.reshape(len(self), -1, inputs.shape[-1])  # (K, rows, n + v)
        rewards = in_blocks(
            lambda block: self._score_rows(block, generator),
            rows,
            len(self) * max(self.config.hidden),
        )
        return rewards.view(inputs.shape[:-1])

    def _score_rows(self, features: Tensor, generator: torch.Generator | None) -> Tensor:
        """Score each member's rows, (K, R, n + v) -> (K, R)."""
        *hidden, (last_weight, last_bias) = zip(self.weights, self.biases, strict=True)
        for (weight, bias), probability in zip(hidden, self.config.dropout, strict=True):
            features = leaky_relu(torch.baddbmm(bias, features, weight), inplace=True)
            if generator is not None:
                features = dropout(features, probability, generator)
        # A sum of products, because batched matrix products are slow at a single column.
        rewards = (features * last_weight.transpose(1, 2)).sum(dim=2) + last_bias[..., 0]
        return torch.tanh(rewards) if self.config.output == "tanh" else rewards

    def score(self, inputs: Tensor) -> Tensor:
        """Score the same raw (s, a), (…, n + v), with every member, (K, …), without dropout."""
        return self.score_scaled(self.scaled(inputs).expand(len(self), *inputs.shape))

    def reward(self, inputs: Tensor) -> Tensor:
        """What is paid: the mean of the members, each normalised by itself, (…, n + v) -> (…)."""
        rows = (-1, *[1] * (inputs.ndim - 1))
        normalised = (self.score(inputs) - self.level.view(rows)) / self.scale.view(rows)
        return normalised.mean(dim=0)

    def standardise(self, pool: SegmentPool) -> None:
        """Fix the input statistics of all members to those of the pool's real steps.

        Raises:
            ShapeError: if the pool has other observations or actions than the members.
        """
        member = self.member(0)
        member.standardise(pool)
        self.mean.copy_(member.mean)
        self.std.copy_(member.std)

    def member(self, index: int) -> RewardNet:
        """A copy of one member as a network of its own."""
        net = RewardNet(*self.shape, torch.Generator())
        own = slice(index, index + 1)
        state = {
            "mean": self.mean,
            "std": self.std,
            "level": self.level[own],
            "scale": self.scale[own],
        }
        for i, (weight, bias) in enumerate(zip(self.weights, self.biases, strict=True)):
            state |= {f"layers.{i}.weight": weight[index].T, f"layers.{i}.bias": bias[index, 0]}
        net.load_state_dict(state)
        return net


def train_ensemble(
    ensemble: RewardEnsemble,
    data: PreferenceData,
    config: RewardTrainingConfig,
    generator: torch.Generator,
    on_epoch: Callable[[int, RewardEnsemble], object] | None = None,
) -> None:
    """Fit all members in place, each on the answers in an order of its own.

    Args:
        ensemble: the members.
        data: the answers.
        config: how to train.
        generator: source of the members' own answers, the batch orders and the dropout masks.
        on_epoch: called after each epoch with its number, from 1, and the ensemble.
    """
    keep_freed_memory()
    data, held_out = split_answers(data, config.validation_share)
    inputs = ensemble.scaled(data.inputs)
    optimiser = make_optimiser(ensemble, config)  # works entry by entry, so members stay apart
    stop = EarlyStop(ensemble, config.stop_accuracy, config.patience)
    stop.after_epoch(validation_loss(ensemble.score, held_out, config))
    member_losses = torch.vmap(lambda rewards, batch: batch_loss(rewards, data, batch, config))
    answers = _own_answers(len(ensemble), len(data), config.bootstrap, generator)  # (K, Q)
    for epoch in range(1, config.epochs + 1):
        orders = [minibatches(len(data), config.batch_size, generator) for _ in answers]
        for batches in zip(*orders, strict=True):
            chosen = answers.gather(1, torch.stack(batches))  # (K, B)
            segments = data.pairs[chosen]  # (K, B, 2)
            steps = segments_of(inputs, segments)  # (K, B, 2, m, n + v)
            rewards = ensemble.score_scaled(steps, generator)
            losses = member_losses(rewards, chosen)  # (K,)
            optimiser.zero_grad()
            losses.sum().backward()  # type: ignore[no-untyped-call]
            optimiser.step()
            stop.count(rewards, data.mask[segments], data.mu[chosen])
        if on_epoch is not None:
            on_epoch(epoch, ensemble)
        if stop.after_epoch(validation_loss(ensemble.score, held_out, config)):
            break
    stop.keep_best()


def _own_answers(
    members: int, count: int, bootstrap: bool, generator: torch.Generator
) -> torch.Tensor:
    """Which answers each member learns from, (K, Q)."""
    if bootstrap:
        return torch.randint(count, (members, count), generator=generator)
    return torch.arange(count).expand(members, -1)


def member_probabilities(
    model: RewardNet | RewardEnsemble, pool: SegmentPool, queries: Sequence[Query]
) -> Floats64:
    """P[σ₁ ≻ σ₂] (POLITE, Eq. 1) of each query as each member sees it, (K, Q)."""
    inputs = torch.from_numpy(np.concatenate([pool.observations, pool.actions], axis=-1))
    with torch.no_grad():
        rewards = model.score(inputs)  # (K, S, m)
    returns = rewards.where(torch.from_numpy(pool.mask), 0.0).sum(dim=2)
    first, second = torch.tensor([(query.first, query.second) for query in queries]).T
    probabilities = torch.sigmoid(returns[:, first] - returns[:, second])
    return np.asarray(probabilities.numpy(), dtype=np.float64)
