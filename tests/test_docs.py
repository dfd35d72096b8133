"""The docs page says what the code says."""

import importlib.util
import re
from pathlib import Path

from polite.experiments.offline.candidates import CANDIDATES

ROOT = Path(__file__).parents[1]


def test_the_page_is_the_one_that_the_code_makes():
    spec = importlib.util.spec_from_file_location("make_docs", ROOT / "docs" / "make.py")
    make = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(make)
    assert make.PAGE.read_text("utf-8") == make.page(), "run python docs/make.py"


def anchors(page):
    """What its headings can be reached by."""
    heads = re.findall(r"^#+ (.*)$", page.read_text("utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", head.lower()).replace(" ", "-") for head in heads}


def test_links_lead_somewhere():
    for page in (ROOT / "README.md", *(ROOT / "docs").glob("*.md"), *ROOT.glob("assets/**/*.md")):
        text = page.read_text("utf-8")
        for link, anchor in re.findall(r"\]\(([^)#\s]*)(?:#([^)\s]*))?\)", text):
            if "://" not in link:
                target = page.parent / link if link else page
                assert target.exists(), f"{page.name}: {link}"
                assert not anchor or anchor in anchors(target), f"{page.name}: {link}#{anchor}"


def test_the_code_of_the_python_page_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = (ROOT / "docs" / "python.md").read_text("utf-8")
    names = {}
    for block in re.findall(r"```python\n(.*?)```", text, re.DOTALL):
        exec(compile(block, "docs/python.md", "exec"), names)
    assert names["agent"].num_timesteps == 200
    assert len(names["feedback"].answers) == 30


def test_the_page_on_highlights_lists_every_candidate():
    text = (ROOT / "docs" / "highlights.md").read_text("utf-8")
    listed = {name for row in re.findall(r"^\| (`.*?) \|", text, re.M) for name in row.split(", ")}
    assert listed == {f"`{name}`" for name in CANDIDATES}
