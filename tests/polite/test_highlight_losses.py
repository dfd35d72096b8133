from math import exp, log

import pytest
import torch
from torch.func import vmap

from polite.highlight_losses import (
    HIGHLIGHT_LOSSES,
    choice_loss,
    margin_loss,
    rival_loss,
    segment_loss,
    summed_paper_loss,
    target_loss,
    window_means,
)
from polite.losses import highlight_loss, paper_loss, polite_loss
from polite.types import ShapeError

WINDOW = {"length": 2, "decay": 0.5}
COMPARING = ("choice", "segment", "margin", "rival", "choice-rival")
forms = pytest.mark.parametrize("form", HIGHLIGHT_LOSSES.values(), ids=HIGHLIGHT_LOSSES)
signs = pytest.mark.parametrize("sign", [+1, -1])


def segments(rows=5, steps=8, seed=0):
    generator = torch.Generator().manual_seed(seed)
    rewards = torch.rand((rows, steps), generator=generator, dtype=torch.float64) * 1.6 - 0.8
    lengths = torch.randint(3, steps + 1, (rows,), generator=generator)
    mask = torch.arange(steps) < lengths[:, None]
    anchors = (torch.rand(rows, generator=generator) * lengths).long()
    anchors[1] = -1
    return rewards, mask, anchors


def test_window_means_by_hand() -> None:
    means = window_means(torch.tensor([[8.0, 4.0, 2.0, 1.0]]), **WINDOW)
    expected = [8, (4 + 4) / 1.5, (2 + 2 + 2) / 1.75, (1 + 1 + 1) / 1.75]
    torch.testing.assert_close(means, torch.tensor([expected]))


def test_a_choice_by_hand() -> None:
    """Two windows of one step: log P is a logistic of m times their difference, weighed by 1/m."""
    rewards, mask = torch.tensor([[0.3, -0.1]]), torch.ones(1, 2).bool()
    for anchor, sign, lead in ((0, +1, 0.4), (1, +1, -0.4), (0, -1, -0.4), (1, -1, 0.4)):
        loss = choice_loss(rewards, mask, torch.tensor([anchor]), length=0, decay=1.0, sign=sign)
        assert loss.item() == pytest.approx(0.5 * log(1 + exp(-2 * lead)), rel=1e-5)


def test_a_flat_reward_leaves_the_choice_to_chance() -> None:
    mask = torch.arange(10) < torch.tensor([[10], [4]])
    loss = choice_loss(torch.zeros(2, 10), mask, torch.tensor([9, 3]), sign=+1, **WINDOW)
    assert loss.item() == pytest.approx(3 / 10 * (log(10) + log(4)), rel=1e-5)


def test_segment_margin_target_and_rival_by_hand() -> None:
    rewards, mask = torch.tensor([[0.6, 0.0], [0.2, 0.2]]), torch.ones(2, 2).bool()
    anchors, window = torch.tensor([0, -1]), {"length": 0, "decay": 1.0, "sign": +1}
    logistic = -log(1 / (1 + exp(-0.3)))
    assert segment_loss(rewards, mask, anchors, **window).item() == pytest.approx(logistic)
    assert margin_loss(rewards, mask, anchors, **window).item() == pytest.approx(0.7)
    cross = -(0.9 * log(0.8) + 0.1 * log(0.2))
    assert target_loss(rewards, mask, anchors, **window).item() == pytest.approx(cross)
    against = log(1 + exp(-0.4))
    assert rival_loss(rewards, mask, anchors, **window).item() == pytest.approx(against)


@signs
def test_the_papers_form_is_equations_4_and_5(sign) -> None:
    rewards, mask, anchors = segments()
    mean = highlight_loss(rewards, anchors, sign=sign, **WINDOW)
    assert paper_loss(rewards, mask, anchors, sign=sign, **WINDOW).item() == mean.item()
    total = summed_paper_loss(rewards, mask, anchors, sign=sign, **WINDOW)
    torch.testing.assert_close(total, 4 * mean)


@forms
@signs
def test_nothing_marked_costs_exactly_nothing(form, sign) -> None:
    rewards, mask, anchors = segments()
    none = torch.full_like(anchors, -1)
    rewards.requires_grad_()
    loss = form(rewards, mask, none, sign=sign, **WINDOW)
    assert loss.item() == 0.0
    loss.backward()
    assert torch.isfinite(rewards.grad).all() and not rewards.grad.any()


@forms
@signs
def test_gradients_agree_with_finite_differences(form, sign) -> None:
    rewards, mask, anchors = segments()
    rewards.requires_grad_()

    def loss(values):
        return form(values, mask, anchors, sign=sign, **WINDOW)

    assert torch.autograd.gradcheck(loss, (rewards,))


@forms
@signs
def test_padding_does_not_matter(form, sign) -> None:
    rewards, mask, anchors = segments()
    junk = rewards.where(mask, 0.7)
    args = {"sign": sign, **WINDOW}
    torch.testing.assert_close(
        form(junk, mask, anchors, **args), form(rewards.where(mask, 0.0), mask, anchors, **args)
    )


@forms
def test_bad_is_good_upside_down(form) -> None:
    rewards, mask, anchors = segments()
    torch.testing.assert_close(
        form(rewards, mask, anchors, sign=+1, **WINDOW),
        form(-rewards, mask, anchors, sign=-1, **WINDOW),
    )


@pytest.mark.parametrize("name", COMPARING)
@signs
def test_forms_that_compare_ask_for_no_level(name, sign) -> None:
    """A constant added to r̂ changes nothing; it would under Eqs. 4 and 5."""
    rewards, mask, anchors = segments()
    form = HIGHLIGHT_LOSSES[name]
    torch.testing.assert_close(
        form(rewards + 3.0, mask, anchors, sign=sign, **WINDOW),
        form(rewards, mask, anchors, sign=sign, **WINDOW),
    )


@forms
@signs
def test_a_step_downhill_lifts_what_is_good_above_what_is_not(form, sign) -> None:
    rewards = torch.zeros(3, 8, dtype=torch.float64, requires_grad=True)
    mask, anchors = torch.ones(3, 8).bool(), torch.tensor([5, 5, -1])
    form(rewards, mask, anchors, sign=sign, **WINDOW).backward()
    after = -rewards.grad
    marked, elsewhere = after[:2, 3:6].mean(), after[:2, [0, 1, 2, 6, 7]].mean()
    assert sign * (marked - elsewhere) > 0


@forms
def test_many_batches_at_once_are_each_by_itself(form) -> None:
    batches = [segments(seed=seed) for seed in range(3)]
    stacked = [torch.stack(parts) for parts in zip(*batches, strict=True)]
    at_once = vmap(lambda *batch: form(*batch, sign=+1, **WINDOW))(*stacked)
    one_by_one = torch.stack([form(*batch, sign=+1, **WINDOW) for batch in batches])
    torch.testing.assert_close(at_once, one_by_one)


@forms
def test_a_form_is_computed_where_the_rewards_are(form) -> None:
    """On a GPU, say; the device "meta" only follows shapes and places."""
    rewards, mask = torch.zeros(3, 8, device="meta"), torch.ones(3, 8, device="meta").bool()
    anchors = torch.zeros(3, dtype=torch.int64, device="meta")
    assert form(rewards, mask, anchors, length=3, decay=0.7, sign=+1).device.type == "meta"


def test_a_form_takes_the_place_of_equations_4_and_5_in_6() -> None:
    rewards, mask, anchors = segments()
    mu = torch.tensor([[1.0, 0.0]]).expand(5, 2).double()
    none = torch.full_like(anchors, -1)
    args = {"alpha_positive": 2.0, "alpha_negative": 3.0, "highlight": choice_loss, **WINDOW}
    preferences = polite_loss(rewards, rewards.flip(0), mask, mask.flip(0), mu, none, none, **args)
    both = polite_loss(rewards, rewards.flip(0), mask, mask.flip(0), mu, anchors, anchors, **args)
    good, bad = (choice_loss(rewards, mask, anchors, sign=s, **WINDOW) for s in (+1, -1))
    torch.testing.assert_close(both, preferences + 2.0 * good + 3.0 * bad)


@forms
def test_anchors_are_as_many_as_the_rows(form) -> None:
    rewards, mask = torch.zeros(4, 6), torch.ones(4, 6, dtype=torch.bool)
    with pytest.raises(ShapeError, match="anchors: expected"):
        form(rewards, mask, torch.tensor([1, 2]), length=2, decay=0.7, sign=1)
