from math import exp, log

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from polite.losses import (
    highlight_loss,
    highlight_return,
    polite_loss,
    preference_loss,
    released_preference_loss,
)
from polite.types import ShapeError

HIGHLIGHTS = {"length": 2, "decay": 0.5}
WEIGHTS = {"alpha_positive": 10.0, "alpha_negative": 5.0}
FORMS = [preference_loss, released_preference_loss]


def tensor(*values):
    return torch.tensor(values, dtype=torch.float64)


def anchors(*values):
    return torch.tensor(values)


def batch(rows=6, steps=5, seed=0):
    """Random rewards and every kind of answer: what a minibatch may hold."""
    generator = torch.Generator().manual_seed(seed)
    lengths = torch.tensor([[5, 3], [5, 5], [2, 5], [1, 1], [5, 5], [4, 5]])[:rows]
    mask = torch.arange(steps) < lengths[..., None]
    return {
        "rewards_1": torch.randn(rows, steps, generator=generator, dtype=torch.float64),
        "rewards_2": torch.randn(rows, steps, generator=generator, dtype=torch.float64),
        "mask_1": mask[:, 0],
        "mask_2": mask[:, 1],
        "mu": tensor([1, 0], [0, 1], [0.5, 0.5], [0, 0], [1, 0], [0, 1])[:rows],
        "positive": anchors(4, 0, -1, -1, -1, 3)[:rows],
        "negative": anchors(-1, 4, -1, -1, 1, -1)[:rows],
    }


def test_preference_loss_by_hand():
    # sigmoid(log 3) = 3/4, so the rows cost −log 3/4, −log 1/4 and −(log 3/4 + log 1/4)/2.
    returns = tensor(log(3), log(3), log(3))
    mu = tensor([1, 0], [0, 1], [0.5, 0.5])
    expected = -(log(3 / 4) + log(1 / 4) + 0.5 * log(3 / 16))
    assert preference_loss(returns, torch.zeros_like(returns), mu).item() == pytest.approx(expected)


def test_preference_loss_is_a_sum_over_the_minibatch():
    once = preference_loss(tensor(1.0), tensor(0.3), tensor([1, 0]))
    twice = preference_loss(tensor(1.0, 1.0), tensor(0.3, 0.3), tensor([1, 0], [1, 0]))
    assert twice.item() == pytest.approx(2 * once.item())


def test_released_loss_by_hand():
    # softmax over the batch: the firsts are (log 1, log 3) → (1/4, 3/4), the seconds equal → 1/2.
    loss = released_preference_loss(tensor(0.0, log(3)), tensor(2.0, 2.0), tensor([1, 0], [0, 1]))
    assert loss.item() == pytest.approx(-(log(1 / 4) + log(1 / 2)))


def test_released_loss_of_a_single_row_is_zero_whatever_was_said():
    assert released_preference_loss(tensor(1.0), tensor(5.0), tensor([1, 0])).item() == 0


@pytest.mark.parametrize("form", FORMS)
def test_unrelated_rows_add_nothing(form):
    mu = tensor([1, 0], [0, 1])
    alone = form(tensor(1.0, 2.0), tensor(0.5, 0.1), mu)
    beside = form(tensor(1.0, 9.0, 2.0), tensor(0.5, -9.0, 0.1), tensor([1, 0], [0, 0], [0, 1]))
    assert beside.item() == pytest.approx(alone.item())


@pytest.mark.parametrize("form", FORMS)
def test_a_minibatch_of_unrelated_pairs_costs_exactly_nothing(form):
    returns = torch.randn(4, dtype=torch.float64, requires_grad=True)
    loss = form(returns, torch.zeros(4, dtype=torch.float64), torch.zeros(4, 2))
    loss.backward()
    assert loss.item() == 0 and not returns.grad.any()


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_extreme_returns_do_not_overflow(form, dtype):
    returns = torch.tensor([1e30, -1e30, 1e4], dtype=dtype, requires_grad=True)
    mu = torch.tensor([[0, 1], [1, 0], [0.5, 0.5]], dtype=dtype)
    loss = form(returns, -returns.detach(), mu)
    loss.backward()
    assert loss.isfinite() and returns.grad.isfinite().all()


@given(st.lists(st.floats(-50, 50), min_size=1, max_size=5))
def test_the_pairwise_loss_is_never_negative_and_equal_costs_at_least_log_2(values):
    returns = tensor(*values)
    half = torch.full((len(values), 2), 0.5, dtype=torch.float64)
    assert preference_loss(returns, -returns, half) >= len(values) * log(2) - 1e-9


def test_highlight_return_by_hand():
    rewards = tensor([1, 2, 4, 8], [1, 2, 4, 8], [1, 2, 4, 8], [1, 2, 4, 8])
    # j = 3: 8 + 4/2 + 2/4;  j = 1 < L: 2 + 1/2;  j = 0: 1;  none: 0.
    result = highlight_return(rewards, anchors(3, 1, 0, -1), **HIGHLIGHTS)
    torch.testing.assert_close(result, tensor(10.5, 2.5, 1.0, 0.0))


def test_a_highlight_has_at_most_length_plus_one_terms():
    ones = torch.ones(1, 9, dtype=torch.float64)
    for j in range(9):
        terms = highlight_return(ones, anchors(j), length=5, decay=1.0).item()
        assert terms == min(j, 5) + 1


def test_a_decay_of_zero_leaves_the_anchor_alone():
    rewards = tensor([1, 2, 4])
    assert highlight_return(rewards, anchors(2), length=2, decay=0.0).item() == 4


def test_highlight_loss_is_the_mean_over_those_present_with_its_sign():
    rewards = tensor([1, 2, 4, 8], [3, 3, 3, 3], [1, 2, 4, 8])
    marks = anchors(3, -1, 1)
    expected = (10.5 + 2.5) / 2
    assert highlight_loss(rewards, marks, **HIGHLIGHTS, sign=+1).item() == -expected
    assert highlight_loss(rewards, marks, **HIGHLIGHTS, sign=-1).item() == expected


@pytest.mark.parametrize("sign", [+1, -1])
def test_no_highlight_in_the_batch_costs_exactly_nothing(sign):
    rewards = torch.randn(3, 4, requires_grad=True)
    loss = highlight_loss(rewards, anchors(-1, -1, -1), **HIGHLIGHTS, sign=sign)
    loss.backward()
    assert loss.item() == 0 and not rewards.grad.any()


def test_polite_loss_by_hand():
    loss = polite_loss(
        tensor([1, 2, 4], [1, 1, 7]),
        tensor([0, 0, 0], [2, 1, 7]),
        torch.tensor([[True, True, True], [True, True, False]]),
        torch.tensor([[True, True, True], [True, True, False]]),
        tensor([1, 0], [0, 1]),
        anchors(2, -1),
        anchors(0, 1),
        **HIGHLIGHTS,
        **WEIGHTS,
    )
    preference = -log(1 / (1 + exp(-7))) - log(1 / (1 + exp(-1)))  # ΔR = 7 and 2 − 3
    positive = -(4 + 2 / 2 + 1 / 4)
    negative = (1 + (1 + 2 / 2)) / 2
    assert loss.item() == pytest.approx(preference + 10 * positive + 5 * negative)


@pytest.mark.parametrize("form", FORMS)
def test_without_alphas_highlights_play_no_part(form):
    feedback = batch()
    config = {**HIGHLIGHTS, "alpha_positive": 0.0, "alpha_negative": 0.0, "preference": form}
    none = torch.full((6,), -1)
    baseline = polite_loss(**{**feedback, "positive": none, "negative": none}, **config)
    assert polite_loss(**feedback, **config).item() == baseline.item()


@pytest.mark.parametrize("form", FORMS)
def test_swapping_the_segments_changes_nothing(form):
    feedback = batch()
    swapped = {
        "rewards_1": feedback["rewards_2"],
        "rewards_2": feedback["rewards_1"],
        "mask_1": feedback["mask_2"],
        "mask_2": feedback["mask_1"],
        "mu": feedback["mu"].flip(1),
        "positive": feedback["positive"],
        "negative": feedback["negative"],
    }
    config = {**HIGHLIGHTS, **WEIGHTS, "preference": form}
    torch.testing.assert_close(polite_loss(**feedback, **config), polite_loss(**swapped, **config))


@pytest.mark.parametrize("form", FORMS)
def test_padding_has_neither_value_nor_gradient(form):
    feedback = batch()
    junk = {
        **feedback,
        "rewards_1": feedback["rewards_1"].where(feedback["mask_1"], 1e6).requires_grad_(),
        "rewards_2": feedback["rewards_2"].where(feedback["mask_2"], torch.nan).requires_grad_(),
    }
    config = {**HIGHLIGHTS, **WEIGHTS, "preference": form}
    loss = polite_loss(**junk, **config)
    torch.testing.assert_close(loss, polite_loss(**feedback, **config))
    loss.backward()
    assert not junk["rewards_1"].grad[~feedback["mask_1"]].any()
    assert not junk["rewards_2"].grad[~feedback["mask_2"]].any()


@pytest.mark.parametrize("form", FORMS)
def test_gradients_match_finite_differences(form):
    feedback = batch()
    others = {k: v for k, v in feedback.items() if not k.startswith("rewards")}

    def loss(rewards_1, rewards_2):
        return polite_loss(rewards_1, rewards_2, **others, **HIGHLIGHTS, **WEIGHTS, preference=form)

    inputs = [feedback[name].requires_grad_() for name in ("rewards_1", "rewards_2")]
    assert torch.autograd.gradcheck(loss, inputs)


def test_highlights_lie_on_the_other_segment_when_told_so():
    feedback = batch()
    config = {**HIGHLIGHTS, **WEIGHTS}
    preferred = torch.tensor([0, 1, 0, 0, 0, 1])
    torch.testing.assert_close(
        polite_loss(**feedback, **config), polite_loss(**feedback, **config, marked=preferred)
    )
    feedback["rewards_1"].requires_grad_()
    feedback["mu"] = torch.zeros(6, 2)
    polite_loss(**feedback, **config, marked=1 - preferred).backward()
    touched = feedback["rewards_1"].grad.any(dim=1)
    assert touched.tolist() == [False, True, False, False, False, True]


def test_a_single_row_is_enough():
    loss = polite_loss(**batch(rows=1), **HIGHLIGHTS, **WEIGHTS)
    assert loss.shape == () and loss.isfinite()


def test_wrong_shapes_are_named():
    with pytest.raises(ShapeError, match=r"mu: expected \(1, 2\), got \(2,\)"):
        preference_loss(tensor(1.0), tensor(1.0), tensor(1, 0))
    with pytest.raises(ShapeError, match="return_2"):
        released_preference_loss(tensor(1.0), tensor(1.0, 2.0), tensor([1, 0]))
    with pytest.raises(ShapeError, match=r"rewards: expected \(B, m\)"):
        highlight_return(tensor(1.0), anchors(0), **HIGHLIGHTS)
    with pytest.raises(ShapeError, match="anchors"):
        highlight_return(tensor([1.0]), anchors(0, 0), **HIGHLIGHTS)
    with pytest.raises(ShapeError, match="mask_2"):
        polite_loss(**{**batch(), "mask_2": torch.ones(6, 4).bool()}, **HIGHLIGHTS, **WEIGHTS)
