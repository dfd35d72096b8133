"""Rewards learned from preferences and highlights (POLITE; Holk, Marta, Leite, ICRA 2024).

The public names are loaded when they are first used, so that `import polite` is instant.
"""

from __future__ import annotations

from importlib import import_module, metadata
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from polite import losses as losses
    from polite.dataset import Feedback as Feedback
    from polite.dataset import load_feedback as load_feedback
    from polite.dataset import save_feedback as save_feedback
    from polite.experiments.training.train import train as train
    from polite.methods.pairs import PairRequest as PairRequest
    from polite.policies.policy import load_policy as load_policy
    from polite.policies.reward_wrapper import LearnedRewardWrapper as LearnedRewardWrapper
    from polite.rewards.files import load_reward_model as load_reward_model
    from polite.types import Answer as Answer
    from polite.types import Highlight as Highlight
    from polite.types import PoliteError as PoliteError
    from polite.types import Query as Query
    from polite.types import Segment as Segment
    from polite.types import SegmentPool as SegmentPool
    from polite.types import Trajectory as Trajectory

    __version__: str

_MODULES = {
    "polite.dataset": ("Feedback", "load_feedback", "save_feedback"),
    "polite.experiments.training.train": ("train",),
    "polite.methods.pairs": ("PairRequest",),
    "polite.policies.policy": ("load_policy",),
    "polite.policies.reward_wrapper": ("LearnedRewardWrapper",),
    "polite.rewards.files": ("load_reward_model",),
    "polite.types": (
        "Answer",
        "Highlight",
        "PoliteError",
        "Query",
        "Segment",
        "SegmentPool",
        "Trajectory",
    ),
}
_HOMES = {name: module for module, names in _MODULES.items() for name in names}

__all__ = [*_HOMES, "__version__", "losses"]


def __getattr__(name: str) -> Any:
    """Load a public name from its module, once."""
    if name == "__version__":
        value: Any = _version()
    elif name == "losses":
        value = import_module("polite.losses")
    elif name in _HOMES:
        value = getattr(import_module(_HOMES[name]), name)
    else:
        raise AttributeError(f"module 'polite' has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """The public names, loaded or not."""
    return sorted({*globals(), *__all__})


def _version() -> str:
    """The installed version; a checkout that is not installed has none."""
    try:
        return metadata.version("socialnav-polite")
    except metadata.PackageNotFoundError:
        return "not installed"
