"""The folder of a study with people, made from a pool of clips."""

from __future__ import annotations

from polite.dataset import MANIFEST, Feedback, save_feedback
from polite.experiments.new_study.config import NewStudyConfig
from polite.experiments.new_study.pool import demo_folder, study_pool
from polite.experiments.new_study.template import fill_template
from polite.experiments.run_folder import claim_folder
from polite.experiments.runner import make_progress
from polite.files import MARKER, read_json_object, write_atomically
from polite.study.clips import check_source, load_clips, prepare_clips
from polite.study.design import FILE, Design, parse_design, read_design
from polite.study.folder import StudyFolder, check_design
from polite.video import check_ffmpeg

_PEOPLE, _PAIRS = 20, 20


def new_study(config: NewStudyConfig) -> StudyFolder:
    """Make a study's folder; a call that was killed is gone on with by one that resumes.

    What is there already is kept: the pool, the researcher's `study.toml` and finished clips.

    Returns:
        The folder, checked.

    Raises:
        PoliteError: The settings do not go together, what they name cannot be read or drawn, or
            the folder is in use. A mistake in the settings leaves no folder.
    """
    check_ffmpeg()
    folder = StudyFolder(config.folder)
    marker = config.folder / MARKER
    if config.resume and marker.exists():
        config = config.begun_with(read_json_object(marker, "restore it").get("study", {}))
    config.check()
    run = {"study": config.settings(), "seed": config.seed}
    if config.resume and (folder.path / FILE).exists():
        claim_folder(folder.path, run, resume=True)
    else:
        feedback, text = _contents(config)
        claim_folder(folder.path, run, config.resume)
        if not (folder.pool_path / MANIFEST).exists():
            save_feedback(folder.pool_path, Feedback(feedback.pool, feedback.queries))
        write_atomically(folder.path / FILE, lambda path: path.write_text(text, encoding="utf-8"))
    check_design(folder.design, folder.feedback)
    _draw(folder)
    assert folder.secrets  # made here, and not by the first of several servers
    folder.check()
    return folder


def describe(folder: StudyFolder) -> str:
    """What the researcher is told at the end."""
    design, count = folder.design, len(set(load_clips(folder.path).values()))
    return (
        f"{folder.path}: {count} clips, {design.participants} participants a condition with "
        f"{design.comparisons} comparisons each\n"
        f"edit {folder.path / FILE}, then: polite study new {folder.path} --resume\n"
        f"begin with: polite serve {folder.path}"
    )


def _contents(config: NewStudyConfig) -> tuple[Feedback, str]:
    """Pool and design, checked against each other."""
    source = config.config or (demo_folder() / FILE if config.is_demo else None)
    if source:
        design = read_design(source)
        feedback = study_pool(config, _pairs(design))
        text = source.read_text(encoding="utf-8")
    else:
        people, pairs = config.participants or _PEOPLE, config.comparisons or _PAIRS
        feedback = study_pool(config, people * pairs)
        text = fill_template(feedback, config.env, people, pairs, config.seed, config.recorded)
    design = parse_design(text)
    check_design(design, feedback)
    check_source(config.folder, design, feedback)
    return feedback, text


def _pairs(design: Design) -> int:
    return design.participants * design.comparisons


def _draw(folder: StudyFolder) -> None:
    """Make the clips, and show how far it is."""
    with make_progress() as progress:
        bar = progress.add_task("drawing clips", total=None)
        prepare_clips(
            folder.path,
            folder.design,
            folder.feedback,
            lambda done, of: progress.update(bar, completed=done, total=of),
        )
