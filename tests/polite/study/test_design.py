"""What a design is read as, and which designs are refused."""

import json
import re

import pytest

from polite.study.columns import questionnaire_columns
from polite.study.design import DesignError, parse_design

pytest_plugins = ["servers"]


@pytest.fixture
def asking(study_folder):
    """The design with another name for its last question."""
    text = (study_folder.path / "study.toml").read_text("utf-8")
    return lambda name: text.replace('name = "comment"', f'name = "{name}"')


@pytest.fixture
def offering(study_folder):
    """The design with other options for its choice."""
    text = (study_folder.path / "study.toml").read_text("utf-8")
    assert '["one", "another"]' in text
    return lambda *options: text.replace('["one", "another"]', json.dumps(options))


NEEDED = ["participant", "condition", "excluded", "csrf", "main", "summary"]


@pytest.mark.parametrize("name", NEEDED)
def test_no_question_takes_a_name_that_the_export_or_the_page_needs(asking, name):
    message = rf"questions\.2\.name: .*expected another name than .*csrf, .*, got '{name}'$"
    with pytest.raises(DesignError, match=message):
        parse_design(asking(name))


def test_these_are_all_names_that_are_needed(site):
    """Columns of the table, fields of the form, ids of the page with everything on it."""
    page = site.participant("questions").post("/questions").text
    needed = set(re.findall(r' (?:id|name)="([a-z][a-z0-9_]*)"', page.split("<body")[1]))
    needed |= {column.name for column in questionnaire_columns(site.design)}
    needed -= {question.name for question in site.design.questions}
    assert needed == set(NEEDED)


def test_options_are_read_as_the_page_shows_and_sends_them(offering):
    (_, group, _) = parse_design(offering(" one", "an\n other ")).questions
    assert group.options == ("one", "an other")


def test_an_option_with_stray_spaces_can_be_chosen(study_folder, offering, request):
    (study_folder.path / "study.toml").write_text(offering(" one ", "another"), "utf-8")
    visitor = request.getfixturevalue("site").participant("questions")
    sent = re.search(r'name="group" value="([^"]*)" id', visitor.load("/questions").text)[1]
    assert visitor.post("/questions", demanding="3", group=sent).status_code == 303


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("one", ""), r"questions\.1\.options\.1: .*at least 1 character"),
        (("one", " "), "group: expected options that differ, and none that is empty"),
        (("one", "two", " one "), "group: expected options that differ"),
    ],
)
def test_empty_and_equal_options_are_refused(offering, options, message):
    with pytest.raises(DesignError, match=message):
        parse_design(offering(*options))
