"""What `polite serve` says before anybody takes part."""

import pytest

from polite.experiments.new_study.template import fill_template
from polite.study.design import parse_design
from polite.study.folder import StudyFolder
from polite.study.web.serve import serve


@pytest.fixture
def said(study_folder, monkeypatch, capsys):
    """What is printed for a study with a text in place of another; nothing is served."""

    def say(old: str = "", new: str = "") -> str:
        path = study_folder.path / "study.toml"
        text = path.read_text("utf-8")
        assert old in text
        path.write_text(text.replace(old, new) if old else text, "utf-8")
        serve(StudyFolder(study_folder.path), "127.0.0.1", 0, 1, "", False)
        return capsys.readouterr().out

    monkeypatch.setattr("uvicorn.run", lambda app, **settings: app.state.site.database.close())
    return say


def test_a_study_whose_texts_are_filled_in_has_no_warning(said):
    printed = said()
    assert "participants  http://localhost:0/join/" in printed
    assert "warning" not in printed


def test_texts_that_are_still_to_be_filled_in_are_named_in_one_line(said):
    printed = said("You see clips of a robot.", "[YOUR NAME, E-MAIL] asks [20] of [YOU], [20].")
    (line,) = (line for line in printed.splitlines() if "warning" in line)
    wanted = "[YOUR NAME, E-MAIL], [20], [YOU]"
    assert line == f"warning: study.toml still has placeholders to fill in: {wanted}"


def test_brackets_that_are_no_placeholders_are_left_alone(said):
    assert "warning" not in said("You see clips", "[All of you] see [1.5] clips [sic] [] [x]")


def test_every_placeholder_of_the_template_is_found(study_folder):
    template = fill_template(study_folder.feedback, None, 1, 3, 0)
    assert parse_design(template).placeholders == [
        "[YOUR NAME]",
        "[INSTITUTION]",
        "[E-MAIL]",
        "[20]",
        "[ETHICS COMMITTEE, NUMBER]",
        "[YOUR NAME, E-MAIL]",
        "[SAY WHAT IT DOES]",
    ]
