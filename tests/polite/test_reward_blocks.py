import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from polite.rewards import blocks
from polite.rewards.blocks import in_blocks
from polite.rewards.ensemble import RewardEnsemble
from polite.rewards.network import FAST, RewardNet, RewardNetConfig, predict


def generator(seed=0):
    return torch.Generator().manual_seed(seed)


@given(rows=st.integers(0, 40), width=st.integers(1, 30), limit=st.integers(1, 50))
def test_each_row_is_scored_once_in_order_and_no_block_is_too_large(rows, width, limit):
    seen = []

    def score(block):
        seen.append(block.shape[-2])
        return block.sum(dim=-1)

    table = torch.arange(2.0 * rows * 3).view(2, rows, 3)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(blocks, "FLOATS_AT_ONCE", limit)
        scores = in_blocks(score, table, width)
    assert torch.equal(scores, table.sum(dim=-1))
    assert max(seen) <= max(1, limit // width) and max(seen) - min(seen) <= 1


def make_model(members, config=FAST):
    nets = [RewardNet(3, 2, config, generator(seed)) for seed in range(members)]
    return nets[0] if members == 1 else RewardEnsemble(nets)


@pytest.mark.parametrize("members", [1, 3])
def test_what_is_paid_does_not_depend_on_blocks(monkeypatch, members):
    model = make_model(members)
    rng = np.random.default_rng(0)
    observations, actions = rng.normal(size=(9, 6, 3)), rng.uniform(-1, 1, (9, 6, 2))
    whole = predict(model, observations, actions)
    monkeypatch.setattr(blocks, "FLOATS_AT_ONCE", 7 * 32 * members)
    np.testing.assert_allclose(predict(model, observations, actions), whole, atol=1e-6)
    assert predict(model, observations[:0], actions[:0]).shape == (0, 6)


@pytest.mark.parametrize("members", [1, 3])
def test_every_block_has_dropout_masks_of_its_own(monkeypatch, members):
    model = make_model(members, RewardNetConfig((32,), (0.5,)))
    inputs = torch.ones((members, 8, 5)) if members > 1 else torch.ones((8, 5))
    monkeypatch.setattr(blocks, "FLOATS_AT_ONCE", 2 * 32 * members)  # four blocks of two rows
    rewards = model(inputs, generator(1)).detach()
    assert torch.equal(rewards, model(inputs, generator(1)))
    assert len(rewards.unique()) == rewards.numel()  # equal rows, other masks


@pytest.mark.parametrize("members", [1, 3])
def test_blocks_change_neither_rewards_nor_gradients(monkeypatch, members):
    model = make_model(members)
    inputs = torch.randn((members, 7, 2, 6, 5), generator=generator())
    inputs = inputs[0] if members == 1 else inputs

    def rewards_and_gradients():
        model.zero_grad()
        rewards = model(inputs)
        (rewards**2).sum().backward()
        return [rewards.detach(), *(p.grad.clone() for p in model.parameters())]

    whole = rewards_and_gradients()
    monkeypatch.setattr(blocks, "FLOATS_AT_ONCE", 11 * 32 * members)
    for seen, expected in zip(rewards_and_gradients(), whole, strict=True):
        torch.testing.assert_close(seen, expected)
