"""What a participant does on the study's pages."""

import re

from playwright.sync_api import expect

from polite.study import schema

NAMES = {
    "left": "Prefer A (left)",
    "right": "Prefer B (right)",
    "equal": "Equal",
    "incomparable": "Cannot compare",
}


class Visitor:
    """Somebody with a browser."""

    def __init__(self, page, served):
        self.page = page
        self.served = served
        self.press = lambda locator: locator.click()  # a finger taps instead

    def begin(self, condition):
        """Join, with new links until the condition is the wanted one, and read the guide."""
        while True:
            self.join()
            if self.record.condition == condition:
                break
            self.page.context.clear_cookies()
        self.press(self.button("Start the practice"))
        self.at("Practice 1 of 1")
        self.press(self.page.locator("#choice .speeds label", has_text="2×"))

    def join(self):
        self.page.goto(self.served.invitation())
        self.press(self.page.get_by_label("I have read this"))
        self.press(self.button("Go on"))
        self.heading("What to look for")

    @property
    def record(self):
        """The newest participant."""
        return self.served.rows(schema.participants)[-1]

    @property
    def answers(self):
        """What is stored, without practice."""
        return [row for row in self.served.answers(self.record.number) if row.place > 0]

    def button(self, name):
        return self.page.get_by_role("button", name=name, exact=True)

    def heading(self, name):
        expect(self.page.get_by_role("heading", name=name, level=1)).to_be_visible()

    def at(self, count):
        """Wait until the progress bar says this, and the trial is shown."""
        expect(self.page.get_by_label(re.compile(f"^{count}$"))).to_be_visible()
        expect(self.page.locator("#choice")).to_be_visible()

    def choose(self, choice):
        """Watch both clips, then answer."""
        button = self.button(NAMES[choice])
        expect(button).to_be_enabled()
        self.press(button)

    def window(self, name):
        return self.page.get_by_role("slider", name=f"{name} passage")

    def touch_timeline(self, share, press):
        """Press the timeline at a share of its width, in the strip's middle, once it listens."""
        timeline = self.page.locator("#highlight .timeline")
        expect(self.page.locator("#highlight")).not_to_have_class("settling")
        timeline.scroll_into_view_if_needed()
        box = timeline.bounding_box()
        press(box["x"] + share * box["width"], box["y"] + box["height"] / 2)

    def practise(self):
        """The practice comparison, without looking long."""
        self.choose("equal")
        self.press(self.button("Continue"))
        self.at("Comparison 1 of 5")

    def fill_in(self):
        """The questionnaire."""
        self.heading("A few questions")
        self.press(self.page.get_by_label("4", exact=True))
        self.press(self.page.get_by_label("another"))
        self.press(self.button("Send and finish"))
        self.heading("Thank you")
