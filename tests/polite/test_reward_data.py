import torch
from hypothesis import given
from hypothesis import strategies as st

from polite.rewards.data import segments_of


@given(
    rows=st.integers(1, 9), shape=st.lists(st.integers(0, 4), max_size=3), seed=st.integers(0, 9)
)
def test_the_chosen_segments_are_those_that_indexing_gives(rows, shape, seed):
    generator = torch.Generator().manual_seed(seed)
    inputs = torch.randn(rows, 3, 2, generator=generator)
    chosen = torch.randint(rows, shape, generator=generator)
    assert torch.equal(segments_of(inputs, chosen), inputs[chosen])
