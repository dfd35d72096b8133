"""Keywords of an env, as the command line takes them."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from polite.types import InvalidValueError


def env_words(settings: Mapping[str, Any]) -> tuple[str, ...]:
    """Keywords as NAME=VALUE.

    Raises:
        InvalidValueError: naming one that JSON, in which they are kept, cannot hold.
    """
    words = []
    for name, value in settings.items():
        try:
            told = value.tolist() if isinstance(value, np.generic | np.ndarray) else value
            words.append(f"{name}={json.dumps(told)}")
        except (TypeError, ValueError) as error:
            raise InvalidValueError(
                f"env_settings: expected what JSON can hold (numbers, words, lists, dicts), got "
                f"{name} = {value!r}; register an env that is made with it"
            ) from error
    return tuple(words)


def parse_env_settings(settings: Sequence[str]) -> dict[str, Any]:
    """Keywords from NAME=VALUE, the value in JSON.

    Raises:
        InvalidValueError: naming the one that is none.
    """
    keywords: dict[str, Any] = {}
    for setting in settings:
        name, _, value = setting.partition("=")
        try:
            keywords[name] = json.loads(value)
        except ValueError as error:
            raise InvalidValueError(
                'env_settings: expected NAME=VALUE with a value in JSON (true, 0.5, "word"), got '
                f"{setting!r}"
            ) from error
    if not all(name.isidentifier() for name in keywords) or len(keywords) < len(settings):
        raise InvalidValueError(
            f"env_settings: expected names of keywords, each once, got {list(settings)}"
        )
    if "seed" in keywords:
        raise InvalidValueError(
            f"env_settings: the envs' seeds follow from --seed, got {list(settings)}"
        )
    return keywords
