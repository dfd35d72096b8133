"""The clips of a study: each segment that it shows, drawn once from its states or recorded."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Final

from polite.clips import FASTEST, Frames, frames_of, renderer
from polite.dataset import Feedback
from polite.files import read_json_object, remove_temporaries, sha256, write_json
from polite.study.design import Design
from polite.types import PoliteError
from polite.video import (
    ENCODING,
    ENDINGS,
    STRIP_FRAMES,
    STRIP_WIDTH,
    check_ffmpeg,
    pad_to_even,
    read_video,
    write_strip,
    write_video,
)

FOLDER: Final = "clips"
"""The clips' folder in a study's folder."""
INDEX: Final = "clips.json"
"""Says which clip is which segment's."""
Pictures = Callable[[int], tuple[Frames, float]]
"""A segment's number -> its frames (T, h, w, 3), and frames per second."""
Progress = Callable[[int, int], None]
"""Is told how many of how many clips are done."""


class ClipError(PoliteError):
    """A clip that is missing or not its segment's."""


@dataclass(frozen=True)
class Clip:
    """One segment as a video, and as a film strip."""

    name: str
    """16 hexadecimal digits that follow from the content and tell nothing of the segment's number:
    `<name>.mp4` and `<name>.png`."""
    steps: int
    """Frames, one a step."""
    fps: float
    """Frames per second."""
    width: int
    """Of the video [px]."""
    height: int
    """Of the video [px]."""


def used_segments(design: Design, feedback: Feedback) -> list[int]:
    """The segments that a study shows: in the guide, in practice and in the comparisons."""
    asked = feedback.queries[: design.participants * design.comparisons]
    compared = {index for query in asked for index in (query.first, query.second)}
    return sorted(compared | design.segments)


def prepare_clips(
    folder: Path, design: Design, feedback: Feedback, progress: Progress = lambda done, of: None
) -> None:
    """Make the clips that are not there yet; a call that is killed is gone on with by the next.

    Args:
        folder: The study's folder.
        design: Whose clips.
        feedback: The segments and the comparisons.
        progress: Is told how far it is.

    Raises:
        ClipError: A recorded clip is missing or has other steps than its segment.
        PoliteError: The env cannot be drawn, or no video can be written.
        ShapeError: The states are another env's.
    """
    used = used_segments(design, feedback)
    names = clip_names(folder, design, feedback, used)
    remove_temporaries(folder / FOLDER)
    made = {i: clip for i, clip in _made(folder).items() if clip.name == names.get(i)}
    missing = [index for index in used if index not in made]
    progress(len(made), len(used))
    if missing:
        check_ffmpeg()
        with _pictures(folder, design, feedback) as pictures:
            for index in missing:
                steps = int(feedback.pool.lengths[index])
                made[index] = _make(folder, names[index], index, steps, pictures)
                _check_pace(index, made)
                _write_index(folder, made)
                progress(len(made), len(used))
    _write_index(folder, made)


def check_source(folder: Path, design: Design, feedback: Feedback) -> None:
    """Check that clips can be made: all recordings are there, or a state can be drawn.

    Raises:
        ClipError: A recorded clip is missing.
        PoliteError: The env cannot be drawn.
        ShapeError: The states are another env's.
    """
    first, *_ = used = used_segments(design, feedback)
    clip_names(folder, design, feedback, used)
    if not design.recorded:
        with renderer(design.env, **design.env_settings) as (render, _):
            frames_of(feedback.pool[first].states[:1], render)


def clip_names(
    folder: Path, design: Design, feedback: Feedback, segments: list[int]
) -> dict[int, str]:
    """Each segment's clip's name; another content or another encoding has another name.

    Raises:
        ClipError: A recorded clip is missing.
    """
    how = [ENCODING, STRIP_FRAMES, STRIP_WIDTH]
    if design.recorded:
        recorded = _recorded(folder, design)
        return {i: _digest(how, sha256(_recording(recorded, i)).encode()) for i in segments}
    drawn = [*how, design.env, design.env_settings]
    return {i: _digest(drawn, feedback.pool[i].states.tobytes()) for i in segments}


def load_clips(folder: Path) -> dict[int, Clip]:
    """Read which clips there are.

    Args:
        folder: The study's folder.

    Returns:
        The clip of each segment's number.

    Raises:
        ClipError: The list of clips is missing or damaged.
    """
    path = folder / FOLDER / INDEX
    remedy = "make the clips again with: polite study new --resume"
    try:
        content = read_json_object(path, remedy)
    except PoliteError as error:
        raise ClipError(str(error)) from error
    names = [field.name for field in fields(Clip)]
    try:
        return {
            int(index): Clip(*(entry[name] for name in names)) for index, entry in content.items()
        }
    except (KeyError, TypeError, ValueError) as error:
        raise ClipError(f"{path}: expected a clip's record for each segment; {remedy}") from error


def clip_files(folder: Path, clip: Clip) -> tuple[Path, Path]:
    """A clip's video and its film strip."""
    return folder / FOLDER / f"{clip.name}.mp4", folder / FOLDER / f"{clip.name}.png"


def _made(folder: Path) -> dict[int, Clip]:
    """The clips that are whole."""
    if not (folder / FOLDER / INDEX).exists():
        return {}
    listed = load_clips(folder).items()
    return {i: clip for i, clip in listed if all(map(Path.is_file, clip_files(folder, clip)))}


def _make(folder: Path, name: str, index: int, steps: int, pictures: Pictures) -> Clip:
    """Draw or read one segment and write its two files."""
    frames, fps = pictures(index)
    if len(frames) != steps:
        raise ClipError(
            f"recorded clip of segment {index}: expected {steps} frames, one a step, "
            f"got {len(frames)}; record it again, a frame before each step"
        )
    frames = pad_to_even(frames)
    height, width = frames.shape[1:3]
    clip = Clip(name, steps, round(fps, 3), width, height)
    video, strip = clip_files(folder, clip)
    write_strip(strip, frames)
    write_video(video, frames, fps)
    return clip


def _check_pace(index: int, made: dict[int, Clip]) -> None:
    """Two clips play in step, so all have one pace.

    Raises:
        ClipError: A recorded clip has another one than those before it.
    """
    first = next(iter(made.values()))
    if made[index].fps != first.fps:
        raise ClipError(
            f"recorded clip of segment {index}: expected {first.fps:g} frames per second as in "
            f"the others, got {made[index].fps:g}; record all at the same pace"
        )


def _write_index(folder: Path, made: dict[int, Clip]) -> None:
    content = {str(index): asdict(clip) for index, clip in sorted(made.items())}
    write_json(folder / FOLDER / INDEX, content)


@contextmanager
def _pictures(folder: Path, design: Design, feedback: Feedback) -> Iterator[Pictures]:
    """Where the frames come from."""
    if design.recorded:
        yield lambda index: read_video(_recording(_recorded(folder, design), index))
        return
    with renderer(design.env, **design.env_settings) as (render, steps_per_second):
        fps = min(FASTEST, steps_per_second)
        yield lambda index: (frames_of(feedback.pool[index].states, render), fps)


def _recorded(folder: Path, design: Design) -> Path:
    """Where the recorded clips are; the study's folder need not be there yet."""
    return (folder / design.recorded).resolve()


def _recording(recorded: Path, index: int) -> Path:
    """The recorded clip of a segment.

    Raises:
        ClipError: There is none, or more than one.
    """
    found = [path for e in ENDINGS if (path := recorded / f"{index}{e}").is_file()]
    if len(found) != 1:
        names = ", ".join(f"{index}{ending}" for ending in ENDINGS)
        seen = ", ".join(path.name for path in found) or "none"
        raise ClipError(
            f"{recorded}: expected one of {names}, found {seen}; record segment {index}"
        )
    return found[0]


def _digest(how: object, content: bytes) -> str:
    """16 hexadecimal digits of what a clip is made from."""
    text = json.dumps(how, sort_keys=True, default=str).encode()
    return hashlib.sha256(text + b"\0" + content).hexdigest()[:16]
