"""A simulated participant of a web study: the real pages and API, without a browser.

Does what the page does: takes the token from the page, sends an answer again, with the same
submission, until it is confirmed, and watches as long as the server demands. Nobody said any of it.
"""

from __future__ import annotations

import asyncio
import time
import uuid
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from html.parser import HTMLParser
from typing import Any

import httpx2
import numpy as np

SPARE = 1.02
"""Watched this much longer than is possible at the least, for clocks that differ."""
Json = dict[str, Any]


@dataclass(frozen=True)
class Decision:
    """What is answered to a trial."""

    choice: str
    good: int | None = None
    bad: int | None = None
    nothing: bool = False


@dataclass(frozen=True)
class Confirmed:
    """An answer that the server says is stored."""

    submission: str
    place: int
    revision: int
    body: Json


@dataclass(frozen=True)
class Exchange:
    """A request and how it went, as the participant saw it."""

    name: str
    began: float
    """By the monotonic clock [s]."""
    seconds: float
    status: int
    """0 where no reply came."""


Decide = Callable[[Json], Decision]
"""The trial as the API gives it -> the answer."""


def at_random(rng: np.random.Generator) -> Decide:
    """Answers anything that is an answer."""

    def decide(trial: Json) -> Decision:
        choice = str(rng.choice(["left", "right", "equal", "incomparable"], p=[0.4, 0.4, 0.1, 0.1]))
        if trial["highlight"] is None or choice not in ("left", "right"):
            return Decision(choice)
        latest = max(0, trial[choice]["steps"] - 1 - trial["highlight"]["length"])
        good, bad = (int(rng.integers(latest + 1)) if rng.random() < 0.7 else None for _ in "gb")
        return Decision(choice, good, bad, nothing=good is None and bad is None)

    return decide


class Robot:
    """One participant; `take_part` goes through the whole study."""

    def __init__(
        self,
        base: str,
        decide: Decide,
        *,
        think: Callable[[], float] = lambda: 0.0,
        again: Callable[[], bool] = lambda: False,
        pause: float = 0.05,
        clips: bool = False,
        confirmed: Callable[[Confirmed], None] = lambda answer: None,
        exchanged: Callable[[Exchange], None] = lambda exchange: None,
    ) -> None:
        """Describe the participant.

        Args:
            base: The server's address.
            decide: What they answer.
            think: How long it takes from a comparison's appearance to its answer [s]; watching is
                part of it and may take longer.
            again: Whether they go back after an answer and change it.
            pause: Before a request is sent again [s].
            clips: Whether clips are fetched, each once, as a browser that keeps them would.
            confirmed: Is told of each answer when it is confirmed.
            exchanged: Is told of each request.
        """
        self.base, self.decide, self.think, self.again = base, decide, think, again
        self.pause, self.clips = pause, clips
        self.tell_confirmed, self.tell_exchanged = confirmed, exchanged
        self.answers: list[Confirmed] = []
        self.page = ""
        """Path of the page that they are at."""
        self._kept: set[str] = set()
        self._headers: dict[str, str] = {}

    async def take_part(self, invitation: str) -> None:
        """From the invitation's path to the last page."""
        client = httpx2.AsyncClient(
            base_url=self.base,
            verify=False,  # loads no certificates: there is no https here
            trust_env=False,
            follow_redirects=True,
            timeout=60.0,
            limits=httpx2.Limits(keepalive_expiry=4.0),  # uvicorn closes after 5 s
        )
        async with client as self._client:
            await self._load(invitation)
            while (html := await self._load("/")) and self.page != "/thanks":
                if self.page == "/compare":
                    self._headers = {"X-CSRF-Token": read_page(html)["csrf"]}
                    await self._compare()
                else:
                    await self._send_form(html)

    async def _load(self, path: str) -> str:
        """A page, loaded until it comes."""
        reply = await self._until_reply("page", "GET", path)
        assert reply.status_code == 200, (path, reply.status_code, reply.text)
        self.page = reply.url.path
        return reply.text

    async def _send_form(self, html: str) -> None:
        """Fill the page's form in; without a reply the participant loads the page again."""
        fields = read_page(html)
        assert "csrf" in fields, f"{self.page}: expected a form"
        reply = await self._request("form", "POST", self.page, data=fields)
        assert reply is None or reply.status_code in (200, 503), reply.text
        if reply is None or reply.status_code == 503:
            await asyncio.sleep(self.pause)

    async def _compare(self) -> None:
        """Answer comparisons until the page would go elsewhere."""
        state = (await self._until_reply("state", "GET", "/api/state")).json()
        place: int | None = state["place"]
        while place is not None:
            following, phase_ends = await self._answer(place)
            if not phase_ends and self.again():  # there is no way back from the next phase
                await self._answer(place)
            place = following

    async def _answer(self, place: int) -> tuple[int | None, bool]:
        """Look at a comparison and answer it; the next place, and whether a phase ends here."""
        path = f"/api/trials/{place}"
        reply = await self._until_reply("trial", "GET", path)
        if reply.status_code == 409:  # the last reply was lost, and nothing is left to compare
            return None, True
        trial, shown = reply.json(), time.time()
        assert reply.status_code == 200, trial
        answer_at = time.monotonic() + self.think()
        if self.clips:
            await self._fetch(trial)
        if not trial["watched"]:
            await self._watch(path, trial)
        watched = time.time()
        await asyncio.sleep(max(0.0, answer_at - time.monotonic()))
        decision = self.decide(trial)
        body = {
            "submission": str(uuid.uuid4()),
            "revision": trial["revision"],
            "choice": decision.choice,
            "good": decision.good,
            "bad": decision.bad,
            "nothing": decision.nothing,
            "shown_at": 1000.0 * shown,
            "watched_at": 1000.0 * watched,
            "chosen_at": 1000.0 * time.time(),
            "answered_at": 1000.0 * time.time(),
            "replays": 0,
        }
        reply = await self._post("answer", f"{path}/answers", body)
        stored = reply.json()
        assert reply.status_code == 200 and stored["stored"], stored
        answer = Confirmed(str(body["submission"]), place, stored["revision"], body)
        self.answers.append(answer)
        self.tell_confirmed(answer)
        return stored["next"], trial["number"] == trial["of"]

    async def _watch(self, path: str, trial: Json) -> None:
        """Play both clips to their end at the highest speed, and say so until it is believed."""
        seconds = max(trial[side]["steps"] for side in ("left", "right")) / trial["fps"]
        wait = SPARE * seconds / max(trial["speeds"])
        while True:
            await asyncio.sleep(wait)
            body = {"client_time": 1000.0 * time.time()}
            reply = await self._post("watched", f"{path}/watched", body)
            if reply.status_code == 200:
                return
            assert reply.status_code == 422, reply.text
            wait = self.pause

    async def _fetch(self, trial: Json) -> None:
        """The clips of a trial, as far as they are not here yet."""
        files = [trial[side]["video"] for side in ("left", "right")]
        if trial["highlight"]:
            files += [trial[side]["strip"] for side in ("left", "right")]
        missing = set(files) - self._kept
        replies = await asyncio.gather(
            *(self._until_reply("clip", "GET", file) for file in missing)
        )
        assert all(reply.status_code == 200 for reply in replies)
        self._kept |= missing

    async def _post(self, name: str, path: str, body: Json) -> httpx2.Response:
        return await self._until_reply(name, "POST", path, json=body, headers=self._headers)

    async def _until_reply(
        self, name: str, method: str, path: str, **given: Any
    ) -> httpx2.Response:
        """Send the same request until the server has an opinion."""
        while True:
            reply = await self._request(name, method, path, **given)
            if reply is not None and reply.status_code != 429 and reply.status_code < 500:
                return reply
            await asyncio.sleep(self.pause)

    async def _request(
        self, name: str, method: str, path: str, **given: Any
    ) -> httpx2.Response | None:
        began, reply = time.monotonic(), None
        with suppress(httpx2.TransportError):
            reply = await self._client.request(method, path, **given)
        status = 0 if reply is None else reply.status_code
        self.tell_exchanged(Exchange(name, began, time.monotonic() - began, status))
        return reply


def read_page(html: str) -> dict[str, str]:
    """The fields of a page's form, filled in; `csrf` comes from the page's head."""
    reader = _Reader()
    reader.feed(html)
    return reader.fields


class _Reader(HTMLParser):
    """Takes the first of the options and ticks every box."""

    def __init__(self) -> None:
        super().__init__()
        self.fields: dict[str, str] = {}

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        have = {name: value or "" for name, value in attrs}
        if tag == "meta" and have.get("name") == "csrf-token":
            self.fields["csrf"] = have["content"]
        if tag in ("input", "textarea") and "name" in have:
            default = {"number": "1", "textarea": "simulated"}.get(have.get("type", tag), "")
            self.fields.setdefault(have["name"], have.get("value") or default)
