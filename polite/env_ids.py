"""From an env's id to an env: modules that register it, quiet models, errors in one line."""

from __future__ import annotations

import importlib
from collections.abc import Iterator
from contextlib import contextmanager

import gymnasium as gym

from polite.files import one_line
from polite.types import PoliteError

_UNMAKEABLE = (gym.error.Error, AssertionError, ImportError, OSError, TypeError, ValueError)
"""What an env says to keywords that it cannot have, a model's file that is not there among them."""


@contextmanager
def making(env_id: str, purpose: str = "") -> Iterator[str]:
    """Make an env in the body of the `with`.

    Args:
        env_id: Its id; of "module:Name-v0" the module, which registers it, is imported first.
        purpose: What it is made for, if not everything; ends "cannot make ID".

    Yields:
        The id without the module.

    Raises:
        PoliteError: It is unknown, or cannot be made as the body tried to.
    """
    module, _, name = env_id.rpartition(":")
    try:
        if module:
            importlib.import_module(module)
        with _quiet_models(name):
            yield name
    except _UNMAKEABLE as error:
        raise PoliteError(f"cannot make {env_id!r}{purpose}: {one_line(error)}") from error


@contextmanager
def _quiet_models(name: str) -> Iterator[None]:
    """Keep MuJoCo's compiler still while Gymnasium's models are read.

    MuJoCo 4 finds something to warn about in HalfCheetah's, every time: on the terminal, over the
    progress bars, and in a MUJOCO_LOG.TXT where the program runs.
    """
    if "mujoco" not in str(gym.spec(name).entry_point):
        yield
        return
    mujoco = importlib.import_module("mujoco")
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda message: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)
