"""Reloads, second thoughts, two tabs, withdrawal and a server that is down, in a real browser."""

import json
import re

from browsers import a_browser, a_served_study, a_visit, check, needs_browser  # noqa: F401
from playwright.sync_api import expect
from visitors import NAMES, Visitor

from polite.study import schema
from polite.study.database import NotStoredError

pytestmark = needs_browser


def test_a_reload_goes_on_at_the_same_step(visit, served):
    visitor = Visitor(visit(), served)
    page = visitor.page
    visitor.begin("polite")
    visitor.practise()
    expect(visitor.button("Equal")).to_be_enabled()
    page.reload()  # in mid-trial: what was watched stays watched
    visitor.at("Comparison 1 of 5")
    expect(visitor.button("Equal")).to_be_enabled()
    expect(page.locator("#choice .watched")).to_have_class(re.compile("done"))
    visitor.choose("right")
    visitor.heading("What stands out")
    visitor.touch_timeline(0.5, page.mouse.click)
    visitor.button("Bad passage").click()
    visitor.touch_timeline(0.99, page.mouse.click)

    page.reload()  # in mid-highlight
    visitor.heading("What stands out")
    expect(page.locator("#highlight figcaption")).to_contain_text("B – right")
    expect(visitor.window("Good")).to_have_attribute("aria-valuenow", "4")
    expect(visitor.window("Bad")).to_have_attribute("aria-valuenow", "8")
    visitor.button("Undo").click()
    expect(visitor.window("Bad")).to_be_hidden()
    visitor.button("Confirm").click()
    visitor.at("Comparison 2 of 5")
    (row,) = visitor.answers
    assert (row.choice, row.good, row.bad) == ("right", 4, None)

    page.goto("/")  # and so does whoever comes back
    visitor.at("Comparison 2 of 5")


def test_an_answer_can_be_changed(visit, served):
    visitor = Visitor(visit(), served)
    page = visitor.page
    visitor.begin("polite")
    visitor.practise()
    expect(page.locator("[data-do=previous]")).to_be_hidden()  # practice is over
    visitor.choose("left")
    visitor.touch_timeline(0.01, page.mouse.click)
    visitor.button("Confirm").click()
    visitor.at("Comparison 2 of 5")
    visitor.choose("equal")
    visitor.at("Comparison 3 of 5")

    for number in (2, 1):
        visitor.button("Back to the previous comparison").click()
        visitor.at(f"Comparison {number} of 5")
    expect(visitor.button(NAMES["left"])).to_have_attribute("aria-pressed", "true")
    expect(page.locator("#choice")).to_contain_text("Your answer is stored: prefer A (left)")
    visitor.choose("left")
    expect(visitor.window("Good")).to_have_attribute("aria-valuenow", "0")
    visitor.button("Nothing stands out").click()
    visitor.at("Comparison 3 of 5")
    visitor.button("Back to the previous comparison").click()
    visitor.at("Comparison 2 of 5")
    visitor.button("Keep this answer and go on").click()
    visitor.at("Comparison 3 of 5")
    expect(page.locator("[data-do=next]")).to_be_hidden()
    found = [(r.place, r.revision, r.choice, r.good, r.nothing_marked) for r in visitor.answers]
    assert found == [
        (1, 1, "left", 0, False),
        (2, 1, "equal", None, False),
        (1, 2, "left", None, True),
    ]


def test_two_tabs_answer_once(visit, served):
    visit.expected.append("409")
    first = Visitor(visit(), served)
    first.begin("baseline")
    first.practise()
    expect(first.button("Equal")).to_be_enabled()
    second = Visitor(first.page.context.new_page(), served)
    second.page.goto("/compare")
    second.at("Comparison 1 of 5")
    second.choose("left")
    second.at("Comparison 2 of 5")

    first.choose("right")
    expect(first.page.get_by_role("alert")).to_contain_text("answered in another tab")
    first.at("Comparison 2 of 5")
    assert [(row.place, row.choice) for row in first.answers] == [(1, "left")]
    first.choose("equal")
    first.at("Comparison 3 of 5")
    expect(first.page.locator("#notice")).to_be_hidden()
    assert [(row.place, row.choice) for row in first.answers] == [(1, "left"), (2, "equal")]


def test_what_another_tab_has_watched_is_told_before_it_is_answered(visit, served):
    visit.expected.append("422")  # while the server's clock says that it is too soon
    visitor = Visitor(visit(), served)
    visitor.begin("baseline")
    visitor.practise()
    visitor.at("Comparison 1 of 5")
    # As a tab leaves it whose own message is lost: the browser knows, the server does not.
    visitor.page.evaluate(
        """() => {
            const key = Object.keys(localStorage).find((name) => name.endsWith(":draft:1"));
            const draft = JSON.parse(localStorage.getItem(key));
            const told = { ...draft, watched: true, watched_at: Date.now() };
            localStorage.setItem(key, JSON.stringify(told));
        }"""
    )
    visitor.page.reload()
    visitor.at("Comparison 1 of 5")
    visitor.choose("equal")
    visitor.at("Comparison 2 of 5")
    assert [(row.place, row.choice) for row in visitor.answers] == [(1, "equal")]


def test_an_answer_outlives_a_server_that_is_down(visit, served):
    visit.expected += ["ERR_CONNECTION", "ERR_EMPTY_RESPONSE"]
    visitor = Visitor(visit(), served)
    page = visitor.page
    visitor.begin("polite")
    visitor.practise()
    visitor.choose("left")
    visitor.touch_timeline(0.01, page.mouse.click)
    served.stop()
    visitor.button("Confirm").click()
    pending = page.locator("#pending")
    expect(pending).to_contain_text("Your answer is not stored yet. It is kept on this page.")
    page.keyboard.press("Enter")  # changes nothing, as it is on its way
    visitor.heading("What stands out")
    assert not visitor.answers
    served.start()
    pending.get_by_role("button", name="Try now").click()
    visitor.at("Comparison 2 of 5")
    expect(pending).to_be_hidden()

    # A browser that is closed meanwhile sends it when it comes back.
    expect(visitor.button("Equal")).to_be_enabled()
    page.route("**/answers", lambda route: route.abort("connectionfailed"))
    visit.expected.append("ERR_FAILED")
    visitor.choose("equal")
    expect(pending).to_contain_text("The server cannot be reached.")
    page.close()
    visitor.page = page.context.new_page()
    visitor.page.goto("/")
    visitor.at("Comparison 3 of 5")
    found = [(row.place, row.revision, row.choice, row.good) for row in visitor.answers]
    assert found == [(1, 1, "left", 0), (2, 1, "equal", None)]


def test_a_questionnaire_that_is_not_stored_can_be_sent_again(visit, served, monkeypatch):
    def locked(*_):
        raise NotStoredError("locked")

    visit.expected.append("503")
    visitor = Visitor(visit(), served)
    page = visitor.page
    visitor.join()
    served.put_at(visitor.record.number, "questions")
    page.goto("/questions")
    page.get_by_label("4", exact=True).click()
    page.get_by_label("another").click()
    page.get_by_label("Anything else?").fill("What only I can write.")
    with monkeypatch.context() as busy:
        busy.setattr("polite.study.web.pages.store_questionnaire", locked)
        visitor.button("Send and finish").click()
        expect(page.get_by_role("alert")).to_contain_text("Your answers are not stored yet")
    assert not served.rows(schema.questionnaires)
    check(page)
    visitor.button("Send and finish").click()
    visitor.heading("Thank you")
    (row,) = served.rows(schema.questionnaires)
    said = {"demanding": 4.0, "group": "another", "comment": "What only I can write."}
    assert json.loads(row.content) == said


def test_withdrawal_deletes_everything(visit, served):
    visit.expected.append("410")
    visitor = Visitor(visit(), served)
    visitor.begin("baseline")
    visitor.practise()
    expect(visitor.button("Equal")).to_be_enabled()
    number, code = visitor.record.number, visitor.record.code

    tab = visitor.page.context.new_page()
    tab.goto("/")
    tab.get_by_role("link", name="Withdraw from the study").click()
    field = tab.get_by_label("Your withdrawal code")
    field.fill("nobody has this")
    tab.get_by_role("button", name="Go on").click()
    expect(tab.get_by_role("alert")).to_contain_text("No participant has this code")
    visit.expected.append("404")
    field.fill(code)
    tab.get_by_role("button", name="Go on").click()
    expect(tab.get_by_role("heading", name="Delete all your answers?")).to_be_visible()
    assert served.answers(number)
    tab.get_by_role("button", name="Delete my answers").click()
    expect(tab.get_by_role("heading", name="Your answers are deleted")).to_be_visible()
    assert not served.answers(number)
    assert not served.rows(schema.participants, number=number)

    visitor.choose("left")  # in the page that was still open
    visitor.heading("You have withdrawn")
    assert not served.answers(number)
    assert not visitor.page.evaluate("Object.keys(localStorage).length")


def test_a_clip_that_does_not_come_is_asked_for_again(visit, served):
    visit.expected += ["ERR_FAILED"]
    visitor = Visitor(visit(), served)
    page = visitor.page
    visitor.begin("baseline")
    page.route("**/clips/*.mp4", lambda route: route.abort())
    page.reload()
    expect(page.get_by_role("alert")).to_have_text("A clip could not be loaded. Trying again.")
    expect(visitor.button("Equal")).to_be_disabled()
    page.unroute_all()
    visitor.practise()


def test_what_was_watched_waits_for_the_server_too(visit, served):
    visit.expected += ["ERR_FAILED"]
    visitor = Visitor(visit(), served)
    page = visitor.page
    visitor.begin("baseline")
    visitor.practise()
    page.route("**/watched", lambda route: route.abort())
    pending = page.locator("#pending")
    expect(pending).to_contain_text("That you have watched both clips is not stored yet.")
    visitor.choose("equal")
    expect(pending).to_contain_text("Your answer is not stored yet.")
    assert not visitor.answers
    page.unroute_all()
    pending.get_by_role("button", name="Try now").click()
    visitor.at("Comparison 2 of 5")
    assert [(row.place, row.choice) for row in visitor.answers] == [(1, "equal")]
