"""Whole participants in a real browser."""

import pytest
from browsers import a_browser, a_served_study, a_visit, needs_browser  # noqa: F401
from playwright.sync_api import expect
from visitors import NAMES, Visitor

pytestmark = needs_browser
DESKTOP = {"viewport": {"width": 1280, "height": 800}}
PHONE = {"viewport": {"width": 360, "height": 740}, "has_touch": True, "is_mobile": True}
TABLET = {"viewport": {"width": 820, "height": 1180}, "has_touch": True, "is_mobile": True}


def stored(row):
    return row.place, row.choice, row.good, row.bad, row.nothing_marked


def check_times(rows):
    for row in rows:
        assert row.client_shown_at <= row.client_watched_at <= row.client_chosen_at
        assert row.client_chosen_at <= row.client_answered_at


def test_preferences_only_by_mouse(visit, served):
    visitor = Visitor(visit(**DESKTOP), served)
    visitor.begin("baseline")
    expect(visitor.page.locator("body")).not_to_contain_text("especially")
    visitor.choose("left")
    visitor.heading("Most people")
    visitor.button("Continue").click()
    choices = ["left", "right", "equal", "incomparable", "left"]
    for number, choice in enumerate(choices, 1):
        visitor.at(f"Comparison {number} of 5")
        visitor.choose(choice)
    visitor.fill_in()
    expected = [(place, choice, None, None, False) for place, choice in enumerate(choices, 1)]
    assert [stored(row) for row in visitor.answers] == expected
    check_times(visitor.answers)
    assert visitor.record.stage == "done"
    expect(visitor.page.locator("[data-code=withdrawal]")).to_have_text(visitor.record.code)


def test_highlights_by_mouse(visit, served):
    visitor = Visitor(visit(**DESKTOP), served)
    page = visitor.page
    mouse = page.mouse
    visitor.begin("polite")
    visitor.practise()

    visitor.choose("right")  # windows of 4 of the 12 steps
    visitor.heading("What stands out")
    confirm = visitor.button("Confirm")
    expect(confirm).to_be_disabled()
    visitor.touch_timeline(2.5 / 12, mouse.click)  # the middle
    expect(visitor.window("Good")).to_have_attribute(
        "aria-valuetext", "good passage from 0.0 s to 0.4 s"
    )
    visitor.button("Bad passage").click()
    visitor.touch_timeline(9.5 / 12, mouse.click)
    visitor.touch_timeline(8.5 / 12, mouse.move)  # on the window: drag it by two steps
    mouse.down()
    visitor.touch_timeline(6.5 / 12, mouse.move)
    mouse.up()
    expect(visitor.window("Bad")).to_have_attribute("aria-valuenow", "5")
    confirm.click()

    visitor.at("Comparison 2 of 5")
    visitor.choose("left")
    page.locator("[data-mark=good]").get_by_role("button", name="Mark here").click()
    visitor.button("Nothing stands out").click()

    visitor.at("Comparison 3 of 5")
    visitor.choose("left")
    visitor.button("Bad passage").click()
    visitor.touch_timeline(0.99, mouse.click)
    visitor.button("Undo").click()
    expect(confirm).to_be_disabled()
    visitor.touch_timeline(0.01, mouse.click)
    preview = page.locator("[data-mark=bad]").get_by_role("button", name="Preview")
    preview.click()
    expect(preview).to_have_attribute("aria-pressed", "true")
    confirm.click()

    visitor.at("Comparison 4 of 5")
    visitor.choose("left")
    visitor.button("Back to the choice").click()
    visitor.choose("incomparable")
    visitor.at("Comparison 5 of 5")
    visitor.choose("equal")
    visitor.fill_in()
    assert [stored(row) for row in visitor.answers] == [
        (1, "right", 0, 5, False),
        (2, "left", None, None, True),
        (3, "left", None, 0, False),
        (4, "incomparable", None, None, False),
        (5, "equal", None, None, False),
    ]
    check_times(visitor.answers)


def tab_to(page, locator):
    """Press Tab until something has the focus."""
    for _ in range(60):
        if locator.evaluate("element => element === document.activeElement"):
            return
        page.keyboard.press("Tab")
    raise AssertionError(f"{locator} is not reached by Tab")


def test_highlights_by_keyboard_only(visit, served):
    visitor = Visitor(visit(**DESKTOP), served)
    page, keys = visitor.page, visitor.page.keyboard

    def press(locator):
        tab_to(page, locator)
        keys.press("Space")

    visitor.press = press
    while True:
        visitor.join()
        if visitor.record.condition == "polite":
            break
        page.context.clear_cookies()
    press(visitor.button("Start the practice"))
    visitor.at("Practice 1 of 1")
    keys.press("s")  # from 1 to 2
    expect(page.locator("#choice").get_by_label("2×")).to_be_checked()

    def answer(key):
        expect(visitor.button("Equal")).to_be_enabled()
        keys.press(key)

    answer("e")
    visitor.heading("Most people")
    press(visitor.button("Continue"))

    visitor.at("Comparison 1 of 5")
    answer("ArrowLeft")
    visitor.heading("What stands out")
    expect(page.locator("#highlight h1")).to_be_focused()
    keys.press("Space")  # pause
    for key in ("g", "Enter", *["Shift+ArrowLeft"] * 3, "ArrowRight", "ArrowRight"):
        keys.press(key)
    expect(visitor.window("Good")).to_have_attribute("aria-valuenow", "2")
    keys.press("b")
    keys.press("Enter")
    tab_to(page, visitor.window("Bad"))
    keys.press("End")
    keys.press("ArrowLeft")
    expect(visitor.window("Bad")).to_have_attribute(
        "aria-valuetext", "bad passage from 0.7 s to 1.1 s"
    )
    keys.press("Delete")
    expect(visitor.window("Bad")).to_be_hidden()
    keys.press("Control+z")
    keys.press("Enter")  # on the button that has the focus now: chooses the bad window
    press(page.locator("#highlight h1 ~ .stage [data-do=confirm]"))

    visitor.at("Comparison 2 of 5")
    expect(page.locator("#choice h1")).to_be_focused()
    answer("ArrowRight")
    visitor.heading("What stands out")
    keys.press("n")
    keys.press("Enter")
    visitor.at("Comparison 3 of 5")
    answer("c")
    visitor.at("Comparison 4 of 5")
    answer("ArrowRight")
    visitor.heading("What stands out")
    keys.press("Escape")
    visitor.heading("Which clip")
    answer("e")
    visitor.at("Comparison 5 of 5")
    answer("e")

    visitor.heading("A few questions")
    tab_to(page, page.get_by_label("1", exact=False).first)
    keys.press("ArrowRight")
    tab_to(page, page.get_by_label("one", exact=True))
    keys.press("Space")
    press(visitor.button("Send and finish"))
    visitor.heading("Thank you")
    assert [stored(row) for row in visitor.answers] == [
        (1, "left", 2, 7, False),
        (2, "right", None, None, True),
        (3, "incomparable", None, None, False),
        (4, "equal", None, None, False),
        (5, "equal", None, None, False),
    ]


def test_a_phone_with_a_finger(visit, served):
    visitor = Visitor(visit(**PHONE), served)
    page = visitor.page
    visitor.press = lambda locator: locator.tap()
    visitor.begin("polite")
    visitor.practise()
    visitor.choose("left")
    visitor.heading("What stands out")
    visitor.touch_timeline(2.5 / 12, page.touchscreen.tap)
    expect(visitor.window("Good")).to_have_attribute("aria-valuenow", "0")
    finger = page.context.new_cdp_session(page)

    def touch(kind):
        def send(x, y):
            points = [] if kind == "touchEnd" else [{"x": x, "y": y}]
            finger.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

        return send

    visitor.touch_timeline(1.5 / 12, touch("touchStart"))
    for step in range(2, 8):
        visitor.touch_timeline((step + 0.5) / 12, touch("touchMove"))
    visitor.touch_timeline(7.5 / 12, touch("touchEnd"))
    expect(visitor.window("Good")).to_have_attribute("aria-valuenow", "6")
    visitor.button("Confirm").click()  # Chromium takes no tap so soon after a drag, on any page
    for number in range(2, 6):
        visitor.at(f"Comparison {number} of 5")
        visitor.choose("equal")
    visitor.fill_in()
    assert stored(visitor.answers[0]) == (1, "left", 6, None, False)


def test_a_double_tap_on_an_answer_marks_nothing(visit, served):
    """The timeline lies where the answer was; the page's clock stands still between the taps."""
    visitor = Visitor(visit(**TABLET), served)
    page = visitor.page
    visitor.press = lambda locator: locator.tap()
    visitor.begin("polite")
    visitor.practise()
    answer = visitor.button(NAMES["left"])
    expect(answer).to_be_enabled()
    page.clock.install()
    page.clock.pause_at(page.evaluate("Date.now() + 1000"))
    box = answer.bounding_box()
    point = box["x"] + box["width"] / 2, box["y"] + 0.8 * box["height"]
    page.touchscreen.tap(*point)
    visitor.heading("What stands out")
    below = page.locator("#highlight .timeline").bounding_box()
    assert below["y"] < point[1] < below["y"] + below["height"]
    page.touchscreen.tap(*point)
    page.clock.run_for(499)
    page.touchscreen.tap(*point)
    page.clock.run_for(1)
    visitor.touch_timeline(0.99, page.touchscreen.tap)
    expect(visitor.window("Good")).to_have_attribute("aria-valuenow", "8")
    visitor.button("Undo").tap()
    expect(visitor.button("Undo")).to_be_disabled()


def test_keys_work_at_once_in_the_highlight_step(visit, served):
    visitor = Visitor(visit(**DESKTOP), served)
    page = visitor.page
    visitor.begin("polite")
    visitor.practise()
    expect(visitor.button(NAMES["left"])).to_be_enabled()
    page.clock.install()
    page.clock.pause_at(page.evaluate("Date.now() + 1000"))
    for key in ("ArrowLeft", "b", "Enter"):
        page.keyboard.press(key)
    expect(page.locator("#highlight")).to_have_class("settling")
    expect(visitor.window("Bad")).to_be_visible()


def test_keys_that_scroll_scroll_and_answer_nothing(visit, served):
    visitor = Visitor(visit(viewport={"width": 1280, "height": 400}), served)
    page = visitor.page
    visitor.begin("baseline")
    heading = page.locator("#choice h1")
    page.evaluate("scrollTo(0, 0)")
    for watched in (False, True):
        if watched:
            expect(visitor.button("Equal")).to_be_enabled()
        for _ in range(10):
            page.keyboard.press("ArrowDown")
        expect(heading).not_to_be_in_viewport()
        for _ in range(10):
            page.keyboard.press("ArrowUp")
        expect(heading).to_be_in_viewport()
    visitor.at("Practice 1 of 1")
    assert not served.answers(visitor.record.number)


def test_arrows_answer_after_the_mouse_has_used_a_control(visit, served):
    visitor = Visitor(visit(**DESKTOP), served)
    page = visitor.page
    visitor.begin("baseline")  # clicks a speed
    expect(visitor.button(NAMES["left"])).to_be_enabled()
    page.locator("#choice [data-do=scrub]").click()
    page.keyboard.press("ArrowRight")
    visitor.button("Continue").click()
    assert [row.choice for row in served.answers(visitor.record.number)] == ["right"]


@pytest.mark.parametrize("watched", [False, True])
def test_scrubbing_is_not_watching(visit, served, watched):
    """Nothing moves by itself where less motion is wanted, and nothing counts that did not play."""
    visitor = Visitor(visit(**DESKTOP, reduced_motion="reduce"), served)
    visitor.begin("baseline")
    page = visitor.page
    play = visitor.button("Play")
    expect(play).to_be_visible()
    if watched:
        play.click()
        expect(visitor.button("Equal")).to_be_enabled()
        return
    scrub = page.locator("#choice").get_by_label("Position in the clip")
    scrub.focus()
    for _ in range(11):
        page.keyboard.press("ArrowRight")
    expect(page.locator("#choice .time")).to_have_text("1.1 s of 1.2 s")
    expect(page.locator("#choice .watched")).to_contain_text("0 % watched")
    expect(visitor.button("Equal")).to_be_disabled()
    page.keyboard.press("u")
    page.locator("#choice h1").focus()
    page.keyboard.press("e")  # too early
    expect(page.locator("#live")).to_have_text("Please watch both clips to the end first.")
    visitor.at("Practice 1 of 1")
    assert not served.answers(visitor.record.number)
