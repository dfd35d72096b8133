import json
import sys

import imageio.v3 as iio
import numpy as np
import pytest

from polite.clips import write_clip
from polite.dataset import Feedback
from polite.rollouts import collect
from polite.segments import cut_segments
from polite.study import clips as module
from polite.study.clips import (
    Clip,
    ClipError,
    clip_files,
    clip_names,
    load_clips,
    prepare_clips,
    used_segments,
)
from polite.types import PoliteError, Query, ShapeError
from polite.video import pad_to_even, read_video, write_strip, write_video


def redesigned(design, **changes):
    return type(design)(**{**design.model_dump(), **changes})


def moving_square(count, height=32, width=48):
    """(count, height, width, 3) frames in which a white square moves to the right."""
    frames = np.zeros((count, height, width, 3), np.uint8)
    for t in range(count):
        frames[t, 8:20, 2 * t : 2 * t + 8] = 255
    return frames


def files_of(folder):
    return {path.name: path.stat().st_mtime_ns for path in (folder / "clips").iterdir()}


def test_every_step_is_a_frame(study_folder) -> None:
    assert sorted(study_folder.clips) == used_segments(study_folder.design, study_folder.feedback)
    for index, clip in study_folder.clips.items():
        video, strip = clip_files(study_folder.path, clip)
        frames, fps = read_video(video)
        assert frames.shape == (study_folder.pool.lengths[index], clip.height, clip.width, 3)
        assert len(frames) == clip.steps
        assert fps == clip.fps == 10.0  # the corridor's steps are 0.1 s
        assert (clip.width % 2, clip.height % 2) == (0, 0)
        assert iio.imread(strip).shape[1] == 10 * min(96, clip.width)


def test_a_clip_shows_its_segment(study_folder) -> None:
    shown = {i: read_video(clip_files(study_folder.path, c)[0])[0] for i, c in
             study_folder.clips.items()}  # fmt: skip
    settings = {"render_width": 96}
    with module.renderer("socialnav_env:SocialCorridor-v0", **settings) as (render, _):
        for index in shown:
            drawn = pad_to_even(module.frames_of(study_folder.pool[index].states, render))
            errors = {
                i: np.abs(drawn.astype(int) - other).mean()
                for i, other in shown.items()
                if other.shape == drawn.shape
            }
            assert min(errors, key=errors.__getitem__) == index, errors
            assert errors[index] < 6


def test_only_what_the_study_shows_is_drawn(study_folder) -> None:
    fewer = redesigned(study_folder.design, participants=1, comparisons=2, practice=())
    queries = study_folder.queries[:2]
    expected = {0, 1} | {index for query in queries for index in (query.first, query.second)}
    assert used_segments(fewer, study_folder.feedback) == sorted(expected)


def test_names_tell_nothing_of_the_number_and_follow_from_the_content(study_folder) -> None:
    design, feedback = study_folder.design, study_folder.feedback
    names = clip_names(study_folder.path, design, feedback, [0, 1, 2])
    assert all(len(name) == 16 and int(name, 16) >= 0 for name in names.values())
    assert len(set(names.values())) == 3
    larger = redesigned(design, env_settings={"render_width": 128})
    assert clip_names(study_folder.path, larger, feedback, [0])[0] != names[0]


def test_finished_clips_are_not_drawn_again(study_folder) -> None:
    before, told = files_of(study_folder.path), []
    prepare_clips(
        study_folder.path,
        study_folder.design,
        study_folder.feedback,
        lambda done, of: told.append((done, of)),
    )
    after = files_of(study_folder.path)
    assert {n: t for n, t in after.items() if n != "clips.json"} == {
        n: t for n, t in before.items() if n != "clips.json"
    }
    assert told == [(len(study_folder.clips),) * 2]


@pytest.mark.parametrize("stops_at", [1, 3])
def test_a_killed_run_is_gone_on_with(study_folder, monkeypatch, stops_at) -> None:
    whole = json.loads((study_folder.path / "clips" / "clips.json").read_text())
    for path in (study_folder.path / "clips").iterdir():
        path.unlink()
    arguments = study_folder.path, study_folder.design, study_folder.feedback
    drawn = []

    def write(path, frames, fps):
        if len(drawn) == stops_at and not stopped:
            stopped.append(path)
            # What SIGKILL leaves: a temporary file that was begun, and no more.
            (path.parent / f".{path.stem}-{'0' * 32}.mp4").write_bytes(b"half")
            raise KeyboardInterrupt
        drawn.append(path.name)
        write_video(path, frames, fps)

    stopped: list = []
    monkeypatch.setattr(module, "write_video", write)
    with pytest.raises(KeyboardInterrupt):
        prepare_clips(*arguments)
    assert len(load_clips(study_folder.path)) == stops_at
    prepare_clips(*arguments)
    assert len(drawn) == len(set(drawn)) == len(whole)
    assert json.loads((study_folder.path / "clips" / "clips.json").read_text()) == whole
    assert not list((study_folder.path / "clips").glob(".*"))
    study_folder.check()


def test_a_lost_file_is_drawn_again_and_no_other(study_folder) -> None:
    lost, _ = clip_files(study_folder.path, study_folder.clips[0])
    lost.unlink()
    before = files_of(study_folder.path)
    prepare_clips(study_folder.path, study_folder.design, study_folder.feedback)
    after = files_of(study_folder.path)
    changed = {name for name in after if after[name] != before.get(name)}
    assert changed == {lost.name, lost.with_suffix(".png").name, "clips.json"}


@pytest.mark.parametrize("ending", ["mp4", "webm", "gif"])
def test_recorded_clips_become_the_same_kind_of_video(study_folder, tmp_path, ending) -> None:
    recorded = tmp_path / "recorded"
    recorded.mkdir()
    for index in range(len(study_folder.pool)):
        frames = np.roll(moving_square(12), index, axis=1)
        path = recorded / f"{index}.{ending}"
        if ending == "gif":
            write_clip(path, frames, fps=20)
        elif ending == "mp4":
            write_video(path, frames, fps=20)
        else:
            iio.imwrite(path, frames, plugin="FFMPEG", fps=20, codec="libvpx", quality=None,
                        macro_block_size=2, ffmpeg_log_level="quiet")  # fmt: skip
    design = redesigned(study_folder.design, env="Nobody-v0", recorded="../recorded")
    prepare_clips(study_folder.path, design, study_folder.feedback)
    clips = load_clips(study_folder.path)
    assert {(c.steps, c.fps, c.width, c.height) for c in clips.values()} == {(12, 20.0, 48, 32)}
    read, _ = read_video(clip_files(study_folder.path, clips[0])[0])
    assert np.abs(read.astype(int) - moving_square(12)).mean() < 8


@pytest.fixture
def recordings(study_folder, tmp_path):
    """A design with recorded clips of 12 frames, and their folder."""
    recorded = tmp_path / "recorded"
    recorded.mkdir()
    for index in range(len(study_folder.pool)):
        write_clip(recorded / f"{index}.gif", moving_square(12), fps=20)
    return redesigned(study_folder.design, recorded=str(recorded)), recorded


def refused(study_folder, design, message):
    with pytest.raises(PoliteError, match=message):
        prepare_clips(study_folder.path, design, study_folder.feedback)


def test_a_recording_with_other_steps_is_refused(study_folder, recordings) -> None:
    design, recorded = recordings
    write_clip(recorded / "1.gif", moving_square(11), fps=20)
    refused(study_folder, design, "segment 1: expected 12 frames, one a step, got 11")


def test_a_recording_at_another_pace_is_refused(study_folder, recordings) -> None:
    design, recorded = recordings
    write_clip(recorded / "1.gif", moving_square(12), fps=10)
    refused(study_folder, design, "expected 20 frames per second as in the others, got 10")


def test_a_missing_recording_is_named(study_folder, recordings) -> None:
    design, recorded = recordings
    (recorded / "1.gif").unlink()
    refused(study_folder, design, "expected one of 1.mp4, 1.webm, 1.gif, found none")


def test_two_recordings_of_one_segment_are_refused(study_folder, recordings) -> None:
    design, recorded = recordings
    write_video(recorded / "1.mp4", moving_square(12), fps=20)
    refused(study_folder, design, "found 1.mp4, 1.gif")


# imageio-ffmpeg leaves its pipes open when ffmpeg finds no video.
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("ending", ["mp4", "gif"])
def test_a_recording_that_is_no_video_is_refused(study_folder, recordings, ending) -> None:
    design, recorded = recordings
    (recorded / "1.gif").unlink()
    (recorded / f"1.{ending}").write_bytes(b"no video")
    refused(study_folder, design, rf"1.{ending}: expected a video or an animated GIF")


def test_without_the_package_it_says_what_to_install(study_folder, monkeypatch) -> None:
    (study_folder.path / "clips" / "clips.json").unlink()
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    refused(study_folder, study_folder.design, r"pip install 'socialnav-polite\[web\]'")


def test_without_the_program_it_says_so(study_folder, monkeypatch) -> None:
    def missing():
        raise RuntimeError("No ffmpeg exe could be found.")

    (study_folder.path / "clips" / "clips.json").unlink()
    monkeypatch.setattr("imageio_ffmpeg.get_ffmpeg_exe", missing)
    refused(study_folder, study_folder.design, "IMAGEIO_FFMPEG_EXE")


def test_an_env_that_cannot_be_drawn_is_refused(study_folder) -> None:
    refused(study_folder, redesigned(study_folder.design, env="Nobody-v0", env_settings={}),
            "cannot make 'Nobody-v0'")  # fmt: skip


@pytest.mark.parametrize("content", ["{", "[]", '{"0": {"name": "a"}}', '{"x": 1}'])
def test_a_damaged_list_of_clips_is_refused(study_folder, content) -> None:
    (study_folder.path / "clips" / "clips.json").write_text(content)
    with pytest.raises(ClipError, match="polite study new --resume"):
        load_clips(study_folder.path)


def test_a_list_of_clips_comes_back_as_it_was(study_folder) -> None:
    clips = {0: Clip("0" * 16, 12, 10.0, 96, 64)}
    module._write_index(study_folder.path, clips)
    assert load_clips(study_folder.path) == clips


def test_odd_frames_get_one_more_row_and_column() -> None:
    frames = moving_square(2, height=23, width=31)
    padded = pad_to_even(frames)
    assert padded.shape == (2, 24, 32, 3)
    np.testing.assert_array_equal(padded[:, :23, :31], frames)
    np.testing.assert_array_equal(padded[:, 23, :31], frames[:, 22])
    with pytest.raises(ShapeError, match="expected"):
        pad_to_even(frames[0])


def test_a_strip_has_the_first_and_the_last_frame(tmp_path) -> None:
    levels = np.arange(23, dtype=np.uint8)[:, None, None, None] * 10
    write_strip(tmp_path / "strip.png", np.broadcast_to(levels, (23, 40, 192, 3)))
    strip = iio.imread(tmp_path / "strip.png")
    assert strip.shape == (20, 960, 3)
    assert (strip[0, ::96, 0] // 10).tolist() == [0, 2, 5, 7, 10, 12, 15, 17, 20, 22]


def test_mujoco_states_become_clips_too(study_folder, make_mujoco) -> None:
    import gymnasium as gym
    from gymnasium.vector import AutoresetMode, SyncVectorEnv

    env = SyncVectorEnv(
        [lambda: make_mujoco("HalfCheetah-v5")], autoreset_mode=AutoresetMode.SAME_STEP
    )
    rng = np.random.default_rng(0)
    actions = gym.spaces.Box(-1, 1, (1, 6), np.float32, seed=0)
    pool = cut_segments(collect(env, lambda o: actions.sample(), 20, 0), 5, 2, rng)
    design = redesigned(
        study_folder.design,
        env="HalfCheetah-v5",
        env_settings={"width": 64, "height": 49},
        participants=1,
        comparisons=2,
    )
    prepare_clips(study_folder.path, design, Feedback(pool, [Query(0, 1)] * 2, []))
    clips = load_clips(study_folder.path)
    assert {(c.steps, c.fps, c.width, c.height) for c in clips.values()} == {(5, 20.0, 64, 50)}
    frames, _ = read_video(clip_files(study_folder.path, clips[0])[0])
    assert len(frames) == 5
    assert frames.std() > 10  # not black
