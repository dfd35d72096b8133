"""Every page and step as a checker of accessibility sees it, on a desk and on a narrow phone."""

import re

import pytest
from browsers import a_browser, a_served_study, a_visit, check, needs_browser  # noqa: F401
from playwright.sync_api import expect
from visitors import Visitor

pytestmark = needs_browser
DESKTOP = {"viewport": {"width": 1280, "height": 800}}
NARROW = {"viewport": {"width": 320, "height": 640}, "has_touch": True, "is_mobile": True}


@pytest.mark.parametrize("screen", [DESKTOP, NARROW], ids=["desktop", "narrow"])
def test_participants_pages(visit, served, screen):
    visitor = Visitor(visit(**screen), served)
    page = visitor.page
    page.goto("/consent?from=link")  # as if the link had left no cookie
    visitor.heading("Your browser seems to keep no cookies")
    check(page)
    page.goto("/")
    check(page)
    page.goto(served.invitation())
    check(page)
    visitor.begin("polite")
    check(page)
    visitor.choose("left")
    visitor.heading("What stands out")
    check(page)
    for name, share in (("Good", 0.2), ("Bad", 0.5)):
        visitor.button(f"{name} passage").click()
        visitor.touch_timeline(share, page.mouse.click)
    page.locator("#keys summary").dispatch_event("click")
    check(page)
    visitor.button("Confirm").click()
    visitor.heading("Most people")
    check(page)
    number = visitor.record.number
    served.put_at(number, "guide")
    page.goto("/guide")
    check(page)
    served.put_at(number, "questions")
    page.goto("/questions")
    check(page)
    visit.expected += ["422", "404"]
    visitor.button("Send and finish").click()
    visitor.heading("A few questions")
    check(page)
    served.put_at(number, "done")
    page.goto("/thanks")
    check(page)
    page.goto("/nowhere")
    check(page)
    page.goto("/withdraw")
    check(page)
    page.get_by_label("Your withdrawal code").fill(visitor.record.code)
    visitor.button("Go on").click()
    visitor.heading("Delete all")
    check(page)
    visitor.button("Delete my answers").click()
    visitor.heading("Your answers are deleted")
    check(page)


@pytest.mark.parametrize("screen", [DESKTOP, NARROW], ids=["desktop", "narrow"])
def test_researchers_pages(visit, served, screen):
    visitor = Visitor(visit(**screen), served)
    page = visitor.page
    page.goto("/researcher")
    check(page)
    page.get_by_label("Token").fill(served.folder.secrets.researcher_token)
    visitor.button("Log in").click()
    visitor.heading("The study so far")
    check(page)
    page.get_by_label("How many people").fill("3")
    visitor.button("Make them").click()
    links = page.get_by_role("rowheader", name=f"{served.base}/join/")
    expect(links).to_have_count(3)
    check(page)
    visitor.button("Log out").click()
    visitor.heading("For the researcher")


HEIGHTS = """
window.heights = new Set();
const look = () => {
  const button = document.querySelector("button.primary");
  if (button) window.heights.add(button.getBoundingClientRect().y);
  requestAnimationFrame(look);
};
requestAnimationFrame(look);
"""


def test_nothing_moves_under_the_pointer_while_the_guide_loads(visit, served):
    """A click whose button has moved away before it is released does nothing."""
    page = visit(viewport={"width": 1280, "height": 800})
    page.add_init_script(HEIGHTS)
    Visitor(page, served).join()
    expect(page.locator("[data-show=time]").first).to_have_text(re.compile("^0[.][1-9]"))
    assert len(page.evaluate("[...heights]")) == 1
