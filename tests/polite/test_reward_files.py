import numpy as np
import pytest
import torch

from polite.rewards.ensemble import RewardEnsemble
from polite.rewards.files import load_reward_model, save_reward_model
from polite.rewards.network import FAST, PAPER, RewardNet, RewardNetConfig, normalise, predict
from polite.types import PoliteError, SegmentPool

LINEAR = RewardNetConfig((8,), (0.0,), "linear")


def generator(seed=0):
    return torch.Generator().manual_seed(seed)


def make_net(config=FAST, seed=0):
    return RewardNet(3, 2, config, generator(seed))


def make_pool(size=20, steps=6, seed=0):
    rng = np.random.default_rng(seed)
    return SegmentPool(
        observations=rng.normal([5.0, -2.0, 7.0], [10.0, 0.1, 0.0], (size, steps, 3)),
        actions=rng.uniform(-1, 1, (size, steps, 2)),
        rewards=np.zeros((size, steps)),
        states=np.zeros((size, steps, 1)),
        lengths=rng.integers(1, steps, size, endpoint=True),
        trajectory=np.zeros(size),
        start=np.zeros(size),
    )


@pytest.mark.parametrize("config", [FAST, PAPER, LINEAR])
def test_a_saved_model_predicts_the_same_when_loaded(tmp_path, config):
    net, pool = make_net(config), make_pool()
    net.standardise(pool)
    normalise(net, pool)
    save_reward_model(tmp_path / "model.pt", net)
    loaded = load_reward_model(tmp_path / "model.pt")
    assert loaded.config == config
    assert loaded(torch.ones(5)) == net(torch.ones(5))
    np.testing.assert_array_equal(
        predict(loaded, pool.observations, pool.actions),
        predict(net, pool.observations, pool.actions),
    )


def _content(**changes):
    net = make_net()
    content = {
        "observation_size": 3,
        "action_size": 2,
        "config": {"hidden": (32, 32), "dropout": (0.0, 0.0)},
        "state": net.state_dict(),
    }
    return {**content, **changes}


@pytest.mark.parametrize(
    "content",
    [
        _content(observation_size=4),
        _content(config={"hidden": (32,), "dropout": (0.0,)}),
        _content(config={"layers": 3}),
        {"state": {}},
        [1, 2],
    ],
)
def test_a_file_that_is_no_reward_model_is_one_line_with_its_name(tmp_path, content):
    torch.save(content, tmp_path / "model.pt")
    with pytest.raises(PoliteError, match=r"model\.pt: expected a reward model") as error:
        load_reward_model(tmp_path / "model.pt")
    assert "\n" not in str(error.value)


def test_shapes_of_a_mismatching_model_are_told(tmp_path):
    torch.save(_content(observation_size=4), tmp_path / "model.pt")
    with pytest.raises(PoliteError, match=r"\[5\].*\[6\]"):
        load_reward_model(tmp_path / "model.pt")


def test_nobody_is_told_to_run_what_is_in_a_file(tmp_path):
    (tmp_path / "results.json").write_text('{"reward": 1}')
    with pytest.raises(PoliteError, match="it holds no tensors") as error:
        load_reward_model(tmp_path / "results.json")
    assert "weights_only" not in str(error.value)


def test_a_missing_or_damaged_file_is_an_error(tmp_path):
    path = tmp_path / "model.pt"
    with pytest.raises(PoliteError, match="no such reward model"):
        load_reward_model(path)
    save_reward_model(path, make_net())
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(PoliteError, match="expected a reward model"):
        load_reward_model(path)


class _Bomb:
    def __reduce__(self):
        return (print, ("this file ran code",))


def test_a_model_file_cannot_run_code(tmp_path, capsys):
    torch.save(_content(state=_Bomb()), tmp_path / "model.pt")
    with pytest.raises(PoliteError, match="expected a reward model"):
        load_reward_model(tmp_path / "model.pt")
    assert not capsys.readouterr().out


def test_a_saved_ensemble_predicts_the_same_when_loaded(tmp_path):
    ensemble, pool = RewardEnsemble([make_net(LINEAR, seed) for seed in range(3)]), make_pool()
    ensemble.standardise(pool)
    normalise(ensemble, pool)
    save_reward_model(tmp_path / "model.pt", ensemble)
    loaded = load_reward_model(tmp_path / "model.pt")
    assert isinstance(loaded, RewardEnsemble) and len(loaded) == 3
    for name, tensor in ensemble.state_dict().items():
        assert torch.equal(loaded.state_dict()[name], tensor)


def test_the_first_files_can_still_be_read(tmp_path):
    net, pool = make_net(), make_pool()
    state = net.state_dict()
    del state["level"], state["scale"]
    torch.save(_content(state=state), tmp_path / "model.pt")
    loaded = load_reward_model(tmp_path / "model.pt")
    assert loaded.config == FAST
    np.testing.assert_array_equal(
        predict(loaded, pool.observations, pool.actions),
        predict(net, pool.observations, pool.actions),
    )


def test_an_ensemble_of_nothing_is_no_reward_model(tmp_path):
    torch.save(_content(members=[]), tmp_path / "model.pt")
    with pytest.raises(PoliteError, match=r"model\.pt: expected a reward model"):
        load_reward_model(tmp_path / "model.pt")
