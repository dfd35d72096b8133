"""What every answer carries, and which requests are too large or too many."""

from __future__ import annotations

import time
from collections import defaultdict, deque
from collections.abc import Callable
from typing import Final

from starlette.datastructures import MutableHeaders
from starlette.requests import Request
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from polite.study.errors import RefusedError

POLICY: Final = "; ".join(
    [
        "default-src 'none'",
        "script-src 'self'",
        "style-src 'self'",
        "img-src 'self'",
        "media-src 'self'",
        "connect-src 'self'",
        "form-action 'self'",
        "base-uri 'none'",
        "frame-ancestors 'none'",
    ]
)
"""Nothing but our own files runs or shows."""
HEADERS: Final = {
    "Content-Security-Policy": POLICY,
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",  # an invitation's address is a secret
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
}
FILES: Final = "/static/"
"""Where our scripts and styles are."""
LARGEST: Final = 256 * 1024
"""Bytes of a request's body."""
MINUTE: Final = 60.0
GUESSES: Final = 20
"""Per minute from one address, of codes and of the researcher's token."""
WRITES: Final = 600
"""Per minute by one participant; from one address where nobody is known."""
GUESSED: Final = ("/withdraw", "/researcher/login")

Problem = Callable[[Request, RefusedError], ASGIApp]
"""Makes the answer to a request that is refused."""


class Headers:
    """Adds the headers; browsers keep no pages, and ask whether our files have changed."""

    def __init__(self, app: ASGIApp) -> None:
        """Wrap an application."""
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request."""

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                headers.update(HEADERS)
                ours = scope["path"].startswith(FILES)
                headers.setdefault("Cache-Control", "no-cache" if ours else "no-store")
            await send(message)

        await self.app(scope, receive, send_with_headers)


class LastMinute:
    """What was counted in the last minute; for one thread."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        """Begin with nothing; the clock gives seconds."""
        self._clock = clock
        self._times: defaultdict[str, deque[float]] = defaultdict(deque)
        self._swept = clock()

    def count(self, who: str, limit: int) -> bool:
        """Count something, unless `limit` of it have been counted; whether it was counted."""
        now = self._clock()
        self._sweep(now)
        times = self._times[who]
        while times and times[0] <= now - MINUTE:
            times.popleft()
        if len(times) >= limit:
            return False
        times.append(now)
        return True

    def _sweep(self, now: float) -> None:
        """Forget those who have not been seen for a minute, or all visitors would be kept."""
        if now - self._swept >= MINUTE:
            self._swept = now
            gone = [who for who, times in self._times.items() if times[-1] <= now - MINUTE]
            for who in gone:
                del self._times[who]


class Limits:
    """Refuses requests that come too often, or that say that they are too large.

    The framework stops reading those that do not say so.
    """

    def __init__(self, app: ASGIApp, problem: Problem) -> None:
        """Wrap an application; must itself lie within the one that reads the session."""
        self.app = app
        self.problem = problem
        self.recent = LastMinute()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, or refuse it."""
        if scope["type"] != "http" or scope["method"] in ("GET", "HEAD"):
            await self.app(scope, receive, send)
            return
        request = Request(scope, receive)
        try:
            _check_size(request)
            self._count(request)
        except RefusedError as error:
            await self.problem(request, error)(scope, receive, send)
        else:
            await self.app(scope, receive, send)

    def _count(self, request: Request) -> None:
        """Count a request.

        Raises:
            RefusedError: There have been too many.
        """
        address = request.client.host if request.client else "unknown"
        guessed = request.url.path in GUESSED
        who = address if guessed else request.session.get("participant", address)
        limit = GUESSES if guessed else WRITES
        if not self.recent.count(f"{guessed} {who}", limit):
            raise RefusedError(429, "That was too often. Please wait a minute and try again.")


def _check_size(request: Request) -> None:
    """Look at the size that a request announces.

    Raises:
        RefusedError: It is too large.
    """
    announced = request.headers.get("content-length", "")
    if announced.isdecimal() and int(announced[:20]) > LARGEST:
        raise RefusedError(413, "That was too long.")
