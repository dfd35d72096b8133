import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from polite.rewards.dropout import dropout
from polite.rewards.network import FAST, PAPER, RewardNet, RewardNetConfig, normalise, predict
from polite.types import InvalidValueError, NotFiniteError, SegmentPool, ShapeError


def generator(seed=0):
    return torch.Generator().manual_seed(seed)


def make_net(config=FAST, seed=0):
    return RewardNet(3, 2, config, generator(seed))


def make_pool(size=20, steps=6, seed=0):
    rng = np.random.default_rng(seed)
    observations = rng.normal([5.0, -2.0, 7.0], [10.0, 0.1, 0.0], (size, steps, 3))
    return SegmentPool(
        observations=observations,
        actions=rng.uniform(-1, 1, (size, steps, 2)),
        rewards=np.zeros((size, steps)),
        states=np.zeros((size, steps, 1)),
        lengths=rng.integers(1, steps, size, endpoint=True),
        trajectory=np.zeros(size),
        start=np.zeros(size),
    )


def test_the_presets_are_the_ones_promised():
    assert PAPER.hidden == (256, 256, 256) and PAPER.dropout == (0.2, 0.5, 0.5)
    assert FAST.hidden == (32, 32) and not any(FAST.dropout)


def test_the_output_drops_the_last_axis_and_lies_within_one():
    net = make_net()
    for shape in ((5,), (4, 5), (2, 3, 4, 5)):
        rewards = net(1e4 * torch.randn(shape, generator=generator()))
        assert rewards.shape == shape[:-1]
        assert (rewards.abs() <= 1).all()


def test_one_hidden_layer_by_hand():
    net = RewardNet(1, 1, RewardNetConfig((2,), (0.0,)), generator())
    state = {
        "layers.0.weight": torch.tensor([[1.0, 2.0], [-1.0, 0.0]]),
        "layers.0.bias": torch.tensor([0.5, 0.0]),
        "layers.1.weight": torch.tensor([[0.3, 2.0]]),
        "layers.1.bias": torch.tensor([-0.1]),
        "mean": torch.tensor([1.0, 0.0]),
        "std": torch.tensor([2.0, 1.0]),
    }
    net.load_state_dict(net.state_dict() | state)
    # (3, .25) standardised: (1, .25); hidden: 2 and leaky −.01; output: .6 − .02 − .1.
    result = net(torch.tensor([3.0, 0.25]))
    assert result.item() == pytest.approx(np.tanh(0.48), abs=1e-6)


def test_equal_generators_give_equal_weights_and_no_global_state_is_touched():
    before = torch.random.get_rng_state()
    one, two, other = make_net(seed=1), make_net(seed=1), make_net(seed=2)
    one(torch.zeros(4, 5), generator())
    assert torch.equal(torch.random.get_rng_state(), before)
    for a, b, c in zip(one.parameters(), two.parameters(), other.parameters(), strict=True):
        assert torch.equal(a, b) and not torch.equal(a, c)


def test_initial_weights_lie_within_pytorch_s_default_bounds():
    for layer in make_net(PAPER).layers:
        bound = layer.in_features**-0.5
        assert 0.9 * bound < layer.weight.abs().max() <= bound
        assert layer.bias.abs().max() <= bound


def test_standardising_uses_real_steps_and_leaves_constants_alone():
    net, pool = make_net(), make_pool()
    net.standardise(pool)
    real = np.concatenate([pool.observations, pool.actions], axis=-1)[pool.mask]
    np.testing.assert_allclose(net.mean, real.mean(axis=0), rtol=1e-5)
    np.testing.assert_allclose(net.std[[0, 1, 3, 4]], real.std(axis=0)[[0, 1, 3, 4]], rtol=1e-4)
    assert net.std[2] == 1


def test_statistics_are_fixed_not_learned():
    net = make_net()
    assert "mean" not in dict(net.named_parameters())
    assert {"mean", "std"} <= set(net.state_dict())


def test_a_pool_of_another_size_is_refused():
    net = RewardNet(4, 2, FAST, generator())
    with pytest.raises(ShapeError, match=r"expected n \+ v = 6 inputs, got 5"):
        net.standardise(make_pool())


def test_prediction_is_the_net_without_dropout_in_any_shape():
    net, pool = make_net(PAPER), make_pool()
    net.standardise(pool)
    rewards = predict(net, pool.observations, pool.actions)
    assert rewards.shape == (20, 6) and rewards.dtype == np.float32
    inputs = torch.from_numpy(np.concatenate([pool.observations, pool.actions], axis=-1))
    np.testing.assert_allclose(rewards, net(inputs).detach(), atol=1e-6)
    one = predict(net, pool.observations[0, 0].astype(np.float64), pool.actions[0, 0])
    assert one.shape == () and one == pytest.approx(rewards[0, 0], abs=1e-6)


def test_a_linear_output_is_the_tanh_one_before_its_tanh():
    linear, bounded = (make_net(RewardNetConfig((8,), (0.0,), form)) for form in ("linear", "tanh"))
    inputs = 100 * torch.randn(9, 5, generator=generator())
    assert linear(inputs).abs().max() > 1
    torch.testing.assert_close(torch.tanh(linear(inputs)), bounded(inputs))


def test_a_normalised_reward_has_mean_0_and_spread_1_over_the_real_steps():
    net, pool = make_net(), make_pool()
    net.standardise(pool)
    raw = predict(net, pool.observations, pool.actions)
    trained = net(torch.ones(5)).item()
    normalise(net, pool)
    paid = predict(net, pool.observations, pool.actions)
    assert paid[pool.mask].mean() == pytest.approx(0.0, abs=1e-5)
    assert paid[pool.mask].std() == pytest.approx(1.0, abs=1e-4)
    np.testing.assert_allclose(
        paid, (raw - raw[pool.mask].mean()) / raw[pool.mask].std(), atol=1e-4
    )
    assert net(torch.ones(5)).item() == trained  # what is trained stays as it is
    normalise(net, pool)  # and so does a second measurement
    np.testing.assert_allclose(predict(net, pool.observations, pool.actions), paid, atol=1e-6)


def test_a_reward_that_is_the_same_everywhere_is_only_centred():
    net = make_net()
    torch.nn.init.zeros_(net.layers[-1].weight)
    normalise(net, make_pool())
    pool = make_pool()
    np.testing.assert_allclose(predict(net, pool.observations, pool.actions), 0.0, atol=1e-6)


def test_prediction_names_what_does_not_fit():
    net = make_net()
    with pytest.raises(ShapeError, match=r"observations: .* expects \(4, 3\), got \(4, 9\)"):
        predict(net, np.zeros((4, 9)), np.zeros((4, 2)))
    with pytest.raises(ShapeError, match=r"actions: .* expects \(4, 2\), got \(5, 2\)"):
        predict(net, np.zeros((4, 3)), np.zeros((5, 2)))
    with pytest.raises(NotFiniteError, match="observations: 12 of 12"):
        predict(net, np.full((4, 3), np.nan), np.zeros((4, 2)))


@pytest.mark.parametrize(
    "shape", [((), ()), ((8,), ()), ((0,), (0.0,)), ((8,), (1.0,)), ((8,), (-0.1,))]
)
def test_impossible_nets_are_refused(shape):
    with pytest.raises(InvalidValueError, match="hidden sizes ≥ 1"):
        RewardNetConfig(*shape)


@pytest.mark.parametrize("probability", [0.2, 0.5, 1 / 3, 0.001, 0.75])
def test_dropout_drops_with_the_given_probability_and_keeps_the_mean(probability):
    count = 1_000_000
    thinned = dropout(torch.ones(count), probability, generator())
    kept = thinned[thinned != 0]
    torch.testing.assert_close(kept, torch.full_like(kept, 1 / (1 - probability)))
    error = (probability * (1 - probability) / count) ** 0.5
    assert 1 - len(kept) / count == pytest.approx(probability, abs=4 * error)


def test_dropout_decides_each_entry_on_its_own():
    dropped = dropout(torch.ones(200_000, 8), 0.2, generator()) == 0
    correlation = np.corrcoef(dropped.numpy().T.astype(float))
    assert abs(correlation - np.eye(8)).max() < 0.01
    flat = dropped.flatten().numpy().astype(float)
    for lag in (1, 8, 64):
        assert abs(np.corrcoef(flat[:-lag], flat[lag:])[0, 1]) < 0.005


def test_dropout_thins_the_gradient_like_the_output():
    inputs = torch.ones(3, 5, requires_grad=True)
    output = dropout(inputs, 0.5, generator())
    output.sum().backward()
    torch.testing.assert_close(inputs.grad, output.detach())


@settings(max_examples=30)
@given(st.integers(0, 40))
def test_dropout_works_for_any_number_of_entries(count):
    assert dropout(torch.ones(count), 0.5, generator()).shape == (count,)


def test_no_dropout_without_a_generator():
    net, inputs = make_net(PAPER), torch.randn(4, 5, generator=generator())
    assert torch.equal(net(inputs), net(inputs))
    assert torch.equal(net(inputs, generator(1)), net(inputs, generator(1)))
    assert not torch.equal(net(inputs, generator(1)), net(inputs, generator(2)))
