import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from polite.rewards import blocks
from polite.rewards.blocks import in_blocks
from polite.rewards.ensemble import RewardEnsemble
from polite.rewards.network import FAST, RewardNet


def generator(seed=0):
    return torch.Generator().manual_seed(seed)


def make_nets(count):
    return [RewardNet(3, 2, FAST, generator(seed)) for seed in range(count)]


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


@pytest.mark.parametrize("members", [1, 3])
def test_blocks_change_neither_rewards_nor_gradients(monkeypatch, members):
    nets = make_nets(members)
    model = nets[0] if members == 1 else RewardEnsemble(nets)
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
