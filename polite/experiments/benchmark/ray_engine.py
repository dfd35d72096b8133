"""Runs on a Ray cluster (extra `ray`)."""

from __future__ import annotations

import socket
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import AbstractContextManager, contextmanager
from typing import Any, Self

import ray
from ray.exceptions import (
    LocalRayletDiedError,
    NodeDiedError,
    ObjectLostError,
    OutOfMemoryError,
    WorkerCrashedError,
)

from polite.experiments.benchmark.engines import P, T
from polite.experiments.workers import ONE_THREAD
from polite.files import one_line
from polite.types import PoliteError

RETRIES = 3
"""How often a run is begun again whose process or node died."""
KNOCK_WITHIN = 10.0
"""Seconds in which a cluster must answer."""


class RayEngine(AbstractContextManager["RayEngine"]):
    """Calls on the nodes of a cluster to which this machine belongs, one core each.

    What a call gives comes back to this process, so its nodes need no common file system for it.
    """

    deaths: tuple[type[Exception], ...] = (
        WorkerCrashedError,
        NodeDiedError,
        LocalRayletDiedError,
        OutOfMemoryError,
        ObjectLostError,  # what came back was on a node that died
    )

    def __init__(self, address: str) -> None:
        """See whether anybody listens.

        Args:
            address: host:port, or "auto" for the cluster that this machine belongs to.

        Raises:
            PoliteError: if nobody does.
        """
        self._address = address
        with self._naming():
            _knock(address)

    def __enter__(self) -> Self:
        """Join the cluster.

        Raises:
            PoliteError: if there is none.
        """
        threads = {"env_vars": dict.fromkeys(ONE_THREAD, "1")}
        with self._naming():
            ray.init(self._address, runtime_env=threads, log_to_driver=False)
        return self

    def __exit__(self, *_: object) -> None:
        """Leave the cluster, which ends what is still running."""
        ray.shutdown()

    @contextmanager
    def _naming(self) -> Iterator[None]:
        """Turn what goes wrong in the body into what to do about it."""
        try:
            yield
        except (OSError, ValueError, RuntimeError) as error:
            raise PoliteError(
                f"no Ray cluster at {self._address} ({one_line(error)}); begin one with `ray start "
                "--head`, or give its --address"
            ) from error

    def submit(self, function: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """As `Engine.submit`; each call has a process of its own, as on one machine."""
        remote: Any = ray.remote(num_cpus=1, max_retries=RETRIES, max_calls=1)(function)
        future: Future[T] = remote.remote(*args, **kwargs).future()
        return future


def _knock(address: str) -> None:
    """See whether anybody listens at an address; Ray itself tries for minutes.

    Raises:
        OSError: if nobody does.
        ValueError: if it is no address.
    """
    if address != "auto":
        host, _, port = address.rpartition(":")
        socket.create_connection((host, int(port)), KNOCK_WITHIN).close()
