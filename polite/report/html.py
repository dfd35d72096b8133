"""The few pieces of HTML that the page is made of; all text is escaped here and only here."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from html import escape
from importlib import resources
from pathlib import Path

MIME = {".png": "image/png", ".gif": "image/gif"}


class Markup(str):
    """Text that is HTML already; every other string is escaped when it is put into an element."""

    __slots__ = ()


def element(name: str, /, *children: str, **attributes: str) -> Markup:
    """`<name ...>children</name>`; `class_` and `colspan` style names lose their underscores."""
    inside = "".join(c if isinstance(c, Markup) else escape(c, quote=False) for c in children)
    return Markup(f"<{name}{_attributes(attributes)}>{inside}</{name}>")


def void(name: str, /, **attributes: str) -> Markup:
    """An element without content, such as `<img ...>`."""
    return Markup(f"<{name}{_attributes(attributes)}>")


def join(parts: Iterable[str], between: str = "") -> Markup:
    """Several pieces one after another, escaped where they are not HTML yet."""
    return Markup(between.join(p if isinstance(p, Markup) else escape(p) for p in parts))


def table(caption: str, head: Sequence[str], rows: Iterable[Sequence[str]]) -> Markup:
    """A table with a caption, a head, and row headers in the first column; it scrolls if wide."""
    top = element("tr", *(element("th", cell, scope="col") for cell in head))
    body = (
        element("tr", element("th", row[0], scope="row"), *(element("td", c) for c in row[1:]))
        for row in rows
    )
    inside = element("caption", caption), element("thead", top), element("tbody", *body)
    frame = {"class_": "scroll", "tabindex": "0", "role": "region", "aria_label": caption}
    return element("div", element("table", *inside), **frame)


def matrix(caption: str, head: Sequence[str], entries: Iterable[tuple[str, str, str]]) -> Markup:
    """A table of (row, column, content) entries; those of one cell stand below each other.

    Rows come in the order in which they are first named; a cell without entries has a dash.
    """
    rows: dict[str, dict[str, list[Markup]]] = {}
    for row, column, content in entries:
        cells = rows.setdefault(row, {name: [] for name in head[1:]})
        cells[column].append(element("div", content, class_="part"))
    body = ((row, *(join(c) if c else "–" for c in cells.values())) for row, cells in rows.items())
    return table(caption, head, body)


def section(identifier: str, title: str, *children: str) -> Markup:
    """A section of the page with its heading."""
    return element("section", element("h2", title), *children, id=identifier)


def figure(path: Path, title: str, caption: str) -> Markup:
    """A picture with its title and caption, which are also what is read out."""
    picture = void("img", src=data_uri(path), alt=f"{title}. {caption}", loading="lazy")
    words = element("figcaption", element("strong", f"{title}. "), caption)
    return element("figure", picture, words, id=path.stem)


def document(title: str, *body: str) -> str:
    """A whole page as text, with its style in it."""
    style = resources.files("polite.report").joinpath("style.css").read_text(encoding="utf-8")
    head = element(
        "head",
        void("meta", charset="utf-8"),
        void("meta", name="viewport", content="width=device-width, initial-scale=1"),
        void("link", rel="icon", href="data:,"),
        element("title", title),
        element("style", Markup(style)),
    )
    page = element("html", head, element("body", *body), lang="en")
    return f"<!DOCTYPE html>\n{page}\n"


def data_uri(path: Path) -> str:
    """A picture's content as a `data:` address, so that the page needs no other file."""
    content = base64.b64encode(path.read_bytes()).decode("ascii")
    return f"data:{MIME[path.suffix]};base64,{content}"


def _attributes(attributes: dict[str, str]) -> str:
    return "".join(
        f' {name.rstrip("_").replace("_", "-")}="{escape(value)}"'
        for name, value in attributes.items()
    )
