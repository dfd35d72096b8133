import json
import os
import warnings

import gymnasium as gym
import imageio.v3 as iio
import matplotlib
import numpy as np
import pygame
import pytest

import socialnav_env  # noqa: F401 (registers the env)
from socialnav_env.keyboard import action_of
from socialnav_env.play import Drive, main, play
from socialnav_env.recording import (
    Recording,
    load_recording,
    save_recording,
    write_video,
)
from socialnav_env.rendering import Window
from socialnav_env.rendering.window import NoDisplayError

KEYWORDS = {"scenario": "paper", "action": "unicycle"}


class Driver:
    """A window in which keys are pressed as a script says: one set of names for each frame."""

    def __init__(self, *script):
        self.script = list(script)
        self.frames = []

    @property
    def closed(self):
        return not self.script

    def show(self, frame, fps):
        self.frames.append((frame.shape, fps))

    def keys(self):
        return self.script.pop(0)

    def close(self):
        self.script = []


def corridor(**settings):
    return gym.make("SocialCorridor-v0", render_mode="rgb_array", render_width=160, **settings)


def driven(*script, seed=0, **settings):
    """The drives that a script gives, as seed, steps, whether the episode was over."""
    kept = []
    play(
        corridor(**settings),
        Driver(*script),
        seed,
        lambda drive: kept.append((drive.seed, len(drive), drive.over)),
    )
    return kept


# --- driving -------------------------------------------------------------------------------------


def test_keys_drive_the_robot():
    env = corridor(num_humans=0)
    drive = Drive(env, 0)
    for _ in range(10):
        drive.step({"up"})
    assert drive.info["x_velocity"] ** 2 + drive.info["z_velocity"] ** 2 == pytest.approx(0.83**2)
    for _ in range(10):
        drive.step(set())
    assert drive.info["z_velocity"] == 0.0
    before = drive.recording({}).states[-1, 2]
    drive.step({"left"})
    assert drive.recording({}).states[-1, 2] == pytest.approx(before + 0.1)


def test_a_holonomic_base_moves_sideways():
    env = corridor(num_humans=0, action="holonomic")
    drive = Drive(env, 0)
    heading = env.unwrapped.state_row()[2]
    drive.step({"left"})
    x, z = drive.info["x_velocity"], drive.info["z_velocity"]
    assert x * np.cos(heading) - z * np.sin(heading) == pytest.approx(0.83)
    assert x * np.sin(heading) + z * np.cos(heading) == pytest.approx(0.0, abs=1e-9)


def test_every_frame_is_a_step_shown_at_the_pace_of_the_env():
    window = Driver({"up"}, {"up"}, set())
    kept = []
    play(corridor(), window, 3, kept.append)
    assert [len(drive) for drive in kept] == [3]
    assert len(window.frames) == 3 and window.frames[0][1] == 10


def test_escape_ends_and_what_was_driven_is_kept():
    assert driven({"up"}, {"up"}, {"escape"}, {"up"}, seed=4) == [(4, 2, False)]


def test_nothing_driven_is_nothing_kept():
    assert driven({"escape"}) == []
    assert driven() == []


def test_r_begins_again_and_forgets():
    assert driven({"up"}, {"up"}, {"r"}, {"up"}, seed=4) == [(4, 1, False)]


def test_space_begins_the_next_episode_once_one_is_over():
    script = [{"up"}, {"space"}, {"up"}, {"up"}, {"space"}, {"up"}]
    assert driven(*script, max_episode_steps=3) == [(0, 3, True), (1, 1, False)]


def test_an_episode_that_is_over_waits():
    assert driven(*[{"up"}] * 9, max_episode_steps=3) == [(0, 3, True)]


# --- recordings ----------------------------------------------------------------------------------


@pytest.fixture
def recording():
    drive = Drive(corridor(**KEYWORDS), 5)
    for t in range(12):
        drive.step({"up", "left"} if t % 3 else {"up"})
    return drive.recording(KEYWORDS)


def test_a_recording_replays_exactly(recording, tmp_path):
    save_recording(tmp_path / "drive.npz", recording)
    loaded = load_recording(tmp_path / "drive.npz")
    env = gym.make("SocialCorridor-v0", **loaded.keywords)
    observation, _ = env.reset(seed=loaded.seed)
    assert observation.tobytes() == loaded.observations[0].tobytes()
    for t, action in enumerate(loaded.actions):
        observation, reward, terminated, truncated, _ = env.step(action)
        assert observation.tobytes() == loaded.observations[t + 1].tobytes()
        assert reward == loaded.rewards[t]
        assert env.unwrapped.state_row().tobytes() == loaded.states[t + 1].tobytes()
    assert (terminated, truncated) == (loaded.terminated, loaded.truncated)


def test_a_recording_survives_the_disk(recording, tmp_path):
    path = tmp_path / "new" / "drive.npz"
    save_recording(path, recording)
    loaded = load_recording(path)
    for name, value in vars(recording).items():
        np.testing.assert_array_equal(getattr(loaded, name), value)
    assert loaded.actions.dtype == np.float32
    assert os.listdir(path.parent) == ["drive.npz"]


def test_a_recording_is_written_whole_or_not_at_all(recording, tmp_path, monkeypatch):
    path = tmp_path / "drive.npz"
    save_recording(path, recording)
    before = path.read_bytes()

    def fail(file, **arrays):
        file.write_bytes(b"half")
        raise OSError("disk full")

    monkeypatch.setattr(np, "savez_compressed", fail)
    with pytest.raises(OSError, match="disk full"):
        save_recording(path, recording)
    assert path.read_bytes() == before
    assert os.listdir(tmp_path) == ["drive.npz"]


@pytest.mark.parametrize("name", ["observations", "actions", "rewards", "states"])
def test_arrays_that_do_not_fit_are_an_error(recording, name):
    content = {**vars(recording), name: getattr(recording, name)[:-1]}
    with pytest.raises(ValueError, match=r"expected 1\d rows"):
        Recording(**content)


def test_other_files_are_an_error(tmp_path):
    with pytest.raises(FileNotFoundError):
        load_recording(tmp_path / "none.npz")
    (tmp_path / "text.npz").write_text("no archive")
    np.savez(tmp_path / "other.npz", values=np.zeros(3))
    np.savez(tmp_path / "pickle.npz", keywords=np.array([{}], dtype=object))
    for name in ("text", "other", "pickle"):
        with pytest.raises(ValueError, match=f"{name}.npz: expected a recording of the corridor"):
            load_recording(tmp_path / f"{name}.npz")


def test_a_video_has_a_frame_for_each_state(recording, tmp_path):
    env = corridor(**KEYWORDS)
    env.reset(seed=5)
    path = tmp_path / "drive.gif"
    write_video(path, recording, env.unwrapped.render_state, 10)
    frames = iio.imread(path)
    assert len(frames) == len(recording.states)
    assert frames.shape[1:] == env.render().shape
    assert iio.immeta(path)["duration"] == 100
    assert os.listdir(tmp_path) == ["drive.gif"]


def test_an_mp4_plays_at_the_pace_of_the_env(recording, tmp_path):
    env = corridor(**KEYWORDS)
    path = tmp_path / "drive.mp4"
    write_video(path, recording, env.unwrapped.render_state, 10)
    assert path.stat().st_size > 1000
    assert iio.immeta(path, plugin="FFMPEG")["fps"] == 10


def test_another_kind_of_video_is_an_error(recording, tmp_path):
    with pytest.raises(ValueError, match=r"drive\.avi: expected a name that ends in one of"):
        write_video(tmp_path / "drive.avi", recording, corridor().unwrapped.render_state, 10)


# --- the command ---------------------------------------------------------------------------------


def test_the_command_keeps_every_episode(tmp_path, capsys):
    window = Driver({"up"}, {"up"}, {"r"}, {"up"}, {"escape"})
    command = ["--scenario", "empty", "--seed", "3", "--width", "160", "--out", str(tmp_path)]
    main([*command, "--video", "gif"], window)
    main(command, Driver({"up"}, {"escape"}))
    assert sorted(os.listdir(tmp_path)) == ["drive-001.gif", "drive-001.npz", "drive-002.npz"]
    loaded = load_recording(tmp_path / "drive-001.npz")
    assert (loaded.seed, len(loaded.actions)) == (3, 1)
    assert loaded.keywords == {"scenario": "empty", "action": "unicycle"}
    told = capsys.readouterr().out
    assert "up: forward, left and right: turn; r: again (an unfinished drive is lost), " in told
    assert "seed 3: no goal after 0.1 s, return" in told
    assert f"kept as {tmp_path / 'drive-001.npz'}" in told


def test_without_a_folder_nothing_is_written(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    main(["--action", "holonomic", "--width", "160"], Driver({"d"}, {"escape"}))
    assert os.listdir(tmp_path) == []
    assert "a and d: turn" in capsys.readouterr().out


def test_people_are_as_one_wants_them(tmp_path):
    people = ["--walking", "queue", "--num-humans", "7"]
    main([*people, "--width", "160", "--out", str(tmp_path)], Driver({"up"}, {"escape"}))
    loaded = load_recording(tmp_path / "drive-001.npz")
    chosen = {"walking": "queue", "num_humans": 7}
    assert loaded.keywords == {"scenario": "paper", "action": "unicycle", **chosen}
    assert loaded.states.shape[1] == 9 + 5 * 7
    env = corridor(**loaded.keywords)
    assert env.reset(seed=loaded.seed)[0].tobytes() == loaded.observations[0].tobytes()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--walking", "fly"], "walking='fly': expected one of cross, along"),
        (["--num-humans", "13"], "num_humans=13: expected a whole number in [0, 12]"),
        (["--num-humans", "two"], "invalid int value: 'two'"),
        (["--scenario", "moon"], "invalid choice: 'moon'"),
        (["--width", "3"], "render_width=3"),
        (["--video", "gif"], "--video needs --out DIR"),
        (["--seed", "-1"], "--seed -1: expected a whole number"),
        (["--overlays", "x-ray"], "invalid choice: 'x-ray'"),
    ],
)
def test_a_mistake_is_one_line(arguments, message, capsys):
    with pytest.raises(SystemExit) as caught:
        main(arguments, Driver({"escape"}))
    assert caught.value.code == 2
    assert message in capsys.readouterr().err


def test_a_missing_encoder_is_told_before_anybody_drives(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("socialnav_env.play.find_spec", lambda name: None)
    with pytest.raises(SystemExit):
        main(["--out", str(tmp_path), "--video", "mp4"], Driver({"up"}))
    assert "needs imageio-ffmpeg" in capsys.readouterr().err


def test_a_missing_display_is_one_line_before_anybody_drives(tmp_path, capsys):
    class Unseen(Driver):
        def show(self, frame, fps):
            raise NoDisplayError("no display was found: use render_mode='rgb_array'")

    with pytest.raises(SystemExit) as caught:
        main(["--width", "160", "--out", str(tmp_path)], Unseen({"up"}))
    assert caught.value.code == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("python -m socialnav_env.play: error: no display was found")
    assert os.listdir(tmp_path) == []


class FastWindow(Window):
    """The real window without its pace."""

    def show(self, frame, fps):
        super().show(frame, 100_000)


def test_a_real_window_takes_real_keys(tmp_path, monkeypatch):
    monkeypatch.setitem(os.environ, "SDL_VIDEODRIVER", "dummy")
    events = [(pygame.KEYDOWN, pygame.K_UP)] + [None] * 3 + [(pygame.KEYDOWN, pygame.K_ESCAPE)]

    class Hands(FastWindow):
        def keys(self):
            event = events.pop(0)
            if event is not None:
                pygame.event.post(pygame.event.Event(event[0], key=event[1]))
            return super().keys()

    main(["--width", "160", "--out", str(tmp_path)], Hands())
    actions = load_recording(tmp_path / "drive-001.npz").actions
    np.testing.assert_array_equal(actions, np.tile(action_of({"up"}, "unicycle"), (4, 1)))
    assert not pygame.display.get_init()


# --- gymnasium's own player ----------------------------------------------------------------------


@pytest.fixture
def gymnasium_play(monkeypatch):
    """`gymnasium.utils.play.play`, whose import would choose a backend for matplotlib."""
    monkeypatch.setitem(os.environ, "SDL_VIDEODRIVER", "dummy")
    monkeypatch.setattr(matplotlib, "use", lambda *arguments, **settings: None)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from gymnasium.utils.play import play

    return play


@pytest.mark.parametrize("kind", ["unicycle", "holonomic"])
def test_gymnasium_plays_it(gymnasium_play, kind):
    env = corridor(action=kind)
    told = []

    def press(*step):
        told.append(step[2])
        key = {1: pygame.K_UP, 3: pygame.K_LEFT}.get(len(told))
        if key is not None:
            pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=key))
        if len(told) == 6:
            pygame.event.post(pygame.event.Event(pygame.QUIT))

    gymnasium_play(env, fps=100_000, callback=press, seed=0, noop=action_of((), kind))
    expected = [action_of(keys, kind) for keys in [(), ("up",), ("up",)] + [("up", "left")] * 3]
    np.testing.assert_array_equal(told, expected)
    assert env.render().shape[2] == 3  # though pygame has been shut down


def test_the_keywords_are_plain_text(recording, tmp_path):
    save_recording(tmp_path / "drive.npz", recording)
    with np.load(tmp_path / "drive.npz", allow_pickle=False) as stored:
        assert json.loads(str(stored["keywords"])) == KEYWORDS
