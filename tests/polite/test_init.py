import subprocess
import sys

import pytest

import polite


def loaded_after(statements: str) -> set[str]:
    """Top-level modules that a fresh interpreter has after these statements."""
    code = f"{statements}\nimport sys; print(*{{name.partition('.')[0] for name in sys.modules}})"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=120
    )
    return set(done.stdout.split())


def test_the_package_alone_loads_nothing_heavy() -> None:
    heavy = {"torch", "gymnasium", "stable_baselines3", "matplotlib", "numpy", "socialnav_env"}
    assert not heavy & loaded_after("import polite")


def test_the_settings_of_the_command_line_load_nothing_heavy() -> None:
    heavy = {"torch", "gymnasium", "stable_baselines3", "matplotlib", "socialnav_env"}
    assert not heavy & loaded_after("import polite.experiments.training.config")


def test_data_types_need_neither_torch_nor_gymnasium() -> None:
    assert not {"torch", "gymnasium"} & loaded_after("import polite; polite.Trajectory")


@pytest.mark.parametrize("name", polite.__all__)
def test_every_public_name_is_there(name: str) -> None:
    assert getattr(polite, name) is not None
    assert name in dir(polite)


def test_public_names_are_those_of_their_modules() -> None:
    from polite.losses import preference_loss
    from polite.rewards.files import load_reward_model
    from polite.types import Trajectory

    assert polite.Trajectory is Trajectory
    assert polite.load_reward_model is load_reward_model
    assert polite.losses.preference_loss is preference_loss


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'teach'"):
        _ = polite.teach


def test_the_version_is_text() -> None:
    assert isinstance(polite.__version__, str) and polite.__version__
