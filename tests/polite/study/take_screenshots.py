"""Take the pictures of the pages in assets/web_page, from the demo: python <this file> FOLDER."""

import io
import re
import sys
import tempfile
from pathlib import Path

from browsers import CHROMIUM, OPTIONS, ServedStudy
from PIL import Image
from playwright.sync_api import expect, sync_playwright
from visitors import Visitor

from polite.experiments.new_study.config import NewStudyConfig
from polite.experiments.new_study.folder import new_study

DESKTOP = {"viewport": {"width": 1280, "height": 800}}
PHONE = {"viewport": {"width": 360, "height": 740}, "has_touch": True, "is_mobile": True}
COLOURS = 128
"""Enough for pages; keeps the pictures small."""


def save(page, folder, name):
    with Image.open(io.BytesIO(page.screenshot(full_page=True))) as picture:
        small = picture.convert("RGB").quantize(COLOURS)
        small.save(folder / f"{name}.png", optimize=True)


def take_part(page, served, folder, suffix=""):
    """Go through the study with highlights, and picture each page on the way."""
    visitor = Visitor(page, served)
    page.goto(served.base)
    save(page, folder, f"landing{suffix}")
    while True:
        page.goto(served.invitation())
        save(page, folder, f"consent{suffix}")
        page.get_by_label("I have read this").click()
        visitor.button("Go on").click()
        visitor.heading("What to look for")
        if visitor.record.condition == "polite":
            break
        page.context.clear_cookies()
    expect(page.locator("[data-show=time]").first).to_have_text(re.compile("^[1-9]"))
    save(page, folder, f"guide{suffix}")
    visitor.button("Start the practice").click()
    visitor.at("Practice 1 of 2")
    save(page, folder, f"watching{suffix}")
    page.locator("#choice .speeds label", has_text="2×").click()
    expect(visitor.button("Prefer A (left)")).to_be_enabled()
    save(page, folder, f"choice{suffix}")
    visitor.choose("left")
    visitor.heading("What stands out in the clip that you prefer?")
    visitor.touch_timeline(0.3, page.mouse.click)
    visitor.button("Bad passage").click()
    visitor.touch_timeline(0.7, page.mouse.click)
    save(page, folder, f"highlight{suffix}")
    visitor.button("Confirm").click()
    expect(visitor.button("Continue")).to_be_visible()
    save(page, folder, f"feedback{suffix}")
    number = visitor.record.number
    page.goto(served.base + "/withdraw")
    save(page, folder, f"withdraw{suffix}")
    served.put_at(number, "questions")
    page.goto(served.base)
    save(page, folder, f"questions{suffix}")
    visitor.button("Send and finish").click()
    expect(page.get_by_role("alert")).to_be_visible()
    save(page, folder, f"questions_missing{suffix}")
    for question in page.locator("fieldset").all():
        question.locator("label").first.click()
    visitor.button("Send and finish").click()
    visitor.heading("Thank you")
    save(page, folder, f"thanks{suffix}")


def research(page, served, folder):
    page.goto(served.base + "/researcher")
    save(page, folder, "researcher_login")
    page.get_by_label("Token").fill(served.folder.secrets.researcher_token)
    page.get_by_role("button", name="Log in").click()
    page.get_by_role("heading", name="The study so far").wait_for()
    save(page, folder, "researcher")


def main(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as temporary, sync_playwright() as playwright:
        served = ServedStudy(new_study(NewStudyConfig(folder=Path(temporary) / "demo")))
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=OPTIONS.split())
        try:
            for settings, suffix in ((DESKTOP, ""), (PHONE, "_phone")):
                page = browser.new_context(**settings).new_page()
                take_part(page, served, folder, suffix)
            research(browser.new_context(**DESKTOP).new_page(), served, folder)
        finally:
            browser.close()
            served.stop()
            served.database.close()


if __name__ == "__main__":
    main(Path(sys.argv[1]))
