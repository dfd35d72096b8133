"""Two tabs of one browser share what is not stored yet."""

from browsers import a_browser, a_served_study, a_visit, needs_browser  # noqa: F401
from playwright.sync_api import expect
from visitors import Visitor

pytestmark = needs_browser


def test_a_tab_whose_answer_another_one_has_sent_goes_on(visit, served):
    visit.expected += ["ERR_FAILED"]
    first = Visitor(visit(), served)
    first.begin("baseline")
    first.practise()
    expect(first.button("Equal")).to_be_enabled()
    first.page.route("**/answers", lambda route: route.abort())
    first.choose("left")
    pending = first.page.locator("#pending")
    expect(pending).to_contain_text("Your answer is not stored yet.")

    second = Visitor(first.page.context.new_page(), served)
    second.page.goto("/compare")
    second.at("Comparison 2 of 5")
    assert [(row.place, row.choice) for row in first.answers] == [(1, "left")]

    first.page.unroute_all()
    pending.get_by_role("button", name="Try now").click()
    first.at("Comparison 2 of 5")
    expect(pending).to_be_hidden()
    first.choose("equal")
    first.at("Comparison 3 of 5")
    assert [(row.place, row.choice) for row in first.answers] == [(1, "left"), (2, "equal")]
