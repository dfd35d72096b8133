"""What every page does alike: stored numbers in, figures and a page out."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from matplotlib import rc_context
from matplotlib.figure import Figure

from polite.files import one_line, write_atomically
from polite.plots.style import STYLE
from polite.types import PoliteError

Results = Mapping[str, Any]


@contextmanager
def reading(numbers: Path, command: str) -> Iterator[None]:
    """Say which file has numbers of another shape, not where the code stumbled over them.

    Args:
        numbers: The file that they are from.
        command: What makes that file anew.

    Raises:
        PoliteError: When a key is missing or a value is of another type.
    """
    again = f"was it written by another version? Run `{command}` again"
    try:
        yield
    except KeyError as missing:
        raise PoliteError(
            f"{numbers}: expected the key {missing}, found none; {again}"
        ) from missing
    except PoliteError:
        raise
    except (TypeError, ValueError, LookupError, AttributeError, ArithmeticError) as error:
        raise PoliteError(f"{numbers}: unexpected value ({one_line(error)}); {again}") from error


def draw_all(
    draw: Mapping[str, Callable[[Results], Figure | None]], results: Results, folder: Path
) -> list[Path]:
    """Draw figures into `folder`, each as a PDF and a PNG of 200 dpi.

    Args:
        draw: Who draws, by file name; what has nothing to show is None and left out.
        results: The stored numbers.
        folder: Where to.

    Returns:
        The PNG files, in the order of `draw`.
    """
    with rc_context(STYLE):
        figures = ((name, draw_one(results)) for name, draw_one in draw.items())
        return [_save(figure, folder / name) for name, figure in figures if figure is not None]


def write_text(path: Path, text: str) -> Path:
    """Write a text whole, in UTF-8, and return where it stands."""
    write_atomically(path, lambda temporary: temporary.write_text(text, encoding="utf-8"))
    return path


def _save(figure: Figure, stem: Path) -> Path:
    """Write STEM.pdf and STEM.png whole; without a date, so that equal numbers give equal files."""
    write_atomically(
        stem.with_suffix(".pdf"),
        lambda path: figure.savefig(path, metadata={"CreationDate": None}),
    )
    figure.set_layout_engine("none")  # laid out already; doing it again costs a third of the time
    write_atomically(stem.with_suffix(".png"), lambda path: figure.savefig(path))
    return stem.with_suffix(".png")
