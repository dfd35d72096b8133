"""Robots that take part in a study as people do: on its pages, in a real browser, all at once.

They know the true reward and answer by it; nobody said any of this. Against a study that is served:

    polite study invite DIR --links 8 | python tests/polite/study/browser_robots.py DIR
"""

from __future__ import annotations

import argparse
import asyncio
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from browsers import CHROMIUM, OPTIONS, PATIENCE
from playwright.async_api import Browser, Locator, Page, async_playwright, expect

from polite.study.clips import load_clips
from polite.study.folder import StudyFolder
from polite.types import SegmentPool

MARKS = ("good", "bad")


@dataclass(frozen=True, eq=False)
class Oracle:
    """Answers by the true reward."""

    pool: SegmentPool
    length: int
    """L: a window has L + 1 steps."""
    stands_out: float
    """A window is worth marking if its mean reward is so far from its clip's [1/step]."""

    def prefers(self, left: int, right: int) -> str:
        """The side of the segment with the larger true return."""
        better = float(self.pool.returns[left] - self.pool.returns[right])
        return "equal" if abs(better) < 1e-9 else "left" if better > 0 else "right"

    def windows(self, segment: int) -> dict[str, int]:
        """The first step of the best and of the worst window, of those that stand out."""
        rewards = self.pool[segment].rewards
        size = min(self.length + 1, len(rewards))
        means = np.convolve(rewards, np.full(size, 1 / size), "valid") - rewards.mean()
        found = {"good": int(means.argmax()), "bad": int(means.argmin())}
        return {name: at for name, at in found.items() if abs(means[at]) > self.stands_out}


class BrowserRobot:
    """One participant: reads the page, presses keys and buttons, and knows no other way."""

    def __init__(self, page: Page, oracle: Oracle, segments: dict[str, int]) -> None:
        """`segments` says by a clip's name what a person would see in it."""
        self.page, self.oracle, self.segments = page, oracle, segments
        self.complaints: list[str] = []
        page.on("pageerror", lambda error: self.complaints.append(str(error)))
        page.on("console", lambda said: said.type == "error" and self.complaints.append(said.text))

    async def take_part(self, invitation: str) -> None:
        """From the invitation to the last page."""
        await self.page.goto(invitation)
        await self.page.get_by_label("I have read this").check()
        await self._button("Go on").click()
        await self._heading("What to look for")
        practises = await self._button("Start the practice").count() > 0
        await self._button("Start the practice" if practises else "Start").click()
        phases = ["Practice", "Comparison"] if practises else ["Comparison"]
        await self._at(f"{phases[0]} 1 of")
        await self._speed_up()
        for phase in phases:
            await self._go_through(phase)
        if await self._questionnaire():
            await self._fill_in()
        await self._heading("Thank you")
        assert not self.complaints, self.complaints

    async def _go_through(self, phase: str) -> None:
        words = await self._at(f"{phase} 1 of")
        for number in range(1, int(words.split()[-1]) + 1):
            await self._at(f"{phase} {number} of")
            await self._compare()
            if phase == "Practice":
                await self._button("Continue").click()

    async def _speed_up(self) -> None:
        """By its key: a button would keep the focus, and with it the arrow keys."""
        speeds = self.page.locator("#choice .speeds").get_by_role("radio")
        while not await speeds.last.is_checked():
            await self.page.keyboard.press("s")

    async def _compare(self) -> None:
        shown = {side: await self._segment(side) for side in ("left", "right")}
        choice = self.oracle.prefers(**shown)
        await expect(self.page.locator(f"#choice [data-choice={choice}]")).to_be_enabled()
        await self.page.keyboard.press(
            {"left": "ArrowLeft", "right": "ArrowRight", "equal": "e"}[choice]
        )
        if choice != "equal" and await self.page.locator("#highlight").count():
            await self._mark(shown[choice])

    async def _mark(self, segment: int) -> None:
        await self._heading("What stands out in the clip that you prefer?")
        windows = self.oracle.windows(segment)
        if not windows:
            await self._button("Nothing stands out").click()
            return
        part = self.page.locator("#highlight")
        await part.locator("[data-do=play]").click()  # it plays by itself: pause
        for name, start in windows.items():
            await part.locator("[data-do=scrub]").fill(str(start))
            await part.locator(f"[data-mark={name}] [data-do=place]").click()
            await self._nudge(part.locator(f".window.{name}"), start)
        await self._button("Confirm").click()

    async def _nudge(self, window: Locator, start: int) -> None:
        """Move the active window step by step to where it shall be."""
        at = int(await window.get_attribute("aria-valuenow") or 0)
        for _ in range(abs(start - at)):
            await self.page.keyboard.press("ArrowRight" if start > at else "ArrowLeft")
        await expect(window).to_have_attribute("aria-valuenow", str(start))

    async def _segment(self, side: str) -> int:
        video = self.page.locator(f"#choice [data-side={side}] video")
        return self.segments[Path(await video.get_attribute("src") or "").stem]

    async def _questionnaire(self) -> bool:
        """Whether there is one after the comparisons."""
        questions = self.page.get_by_role("heading", name="A few questions")
        await expect(
            questions.or_(self.page.get_by_role("heading", name="Thank you"))
        ).to_be_visible()
        return await questions.count() > 0

    async def _fill_in(self) -> None:
        for question in await self.page.locator(".question").all():
            if await question.get_by_role("radio").count():
                await question.locator("label.radio").first.click()
            elif await question.get_by_role("spinbutton").count():
                await question.get_by_role("spinbutton").fill("1")
            else:
                await question.get_by_role("textbox").fill("simulated: a robot answered")
        await self._button("Send and finish").click()

    async def _at(self, count: str) -> str:
        """Wait until the progress bar says this, and the comparison is shown; all of its words."""
        label = self.page.locator("#progress label", has_text=count)
        await expect(label).to_be_visible()
        await expect(self.page.locator("#choice")).to_be_visible()
        return await label.inner_text()

    async def _heading(self, name: str) -> None:
        await expect(self.page.get_by_role("heading", name=name, level=1)).to_be_visible()

    def _button(self, name: str) -> Locator:
        return self.page.get_by_role("button", name=name, exact=True)


async def robots_answer(
    folder: StudyFolder, invitations: Sequence[str], stands_out: float
) -> list[float]:
    """Let a robot follow each invitation, all at once, each in a browser context of its own.

    Returns:
        How long each took [s].
    """
    oracle = Oracle(folder.feedback.pool, folder.design.highlight_length, stands_out)
    segments = {clip.name: index for index, clip in load_clips(folder.path).items()}

    async def one(browser: Browser, invitation: str) -> float:
        context = await browser.new_context(viewport={"width": 1280, "height": 800})
        context.set_default_timeout(PATIENCE)
        began = time.monotonic()
        robot = BrowserRobot(await context.new_page(), oracle, segments)
        await robot.take_part(invitation)
        await context.close()
        return time.monotonic() - began

    expect.set_options(timeout=PATIENCE)
    async with async_playwright() as playwright:
        browser = await playwright.chromium.launch(executable_path=CHROMIUM, args=OPTIONS.split())
        taken = await asyncio.gather(*(one(browser, invitation) for invitation in invitations))
        await browser.close()
    return taken


def main() -> None:
    """Follow the invitations of the standard input."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("study", type=Path, help="the study's folder")
    parser.add_argument("--stands-out", type=float, default=0.005, help="see Oracle")
    given = parser.parse_args()
    invitations = sys.stdin.read().split()
    taken = asyncio.run(robots_answer(StudyFolder(given.study), invitations, given.stands_out))
    print(f"{len(taken)} robots took {min(taken):.0f} to {max(taken):.0f} s")


if __name__ == "__main__":
    main()
