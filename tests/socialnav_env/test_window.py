import os

import numpy as np
import pygame
import pytest

from socialnav_env.config import CorridorConfig
from socialnav_env.rendering import Scene, Window, draw_scene
from socialnav_env.rendering.window import NoDisplayError

CONFIG = CorridorConfig()
NOBODY = np.empty((0, 5))
PEOPLE = np.array([[1.5, -10.0, 0.2, 0.2, 0.9], [1.4, 8.0, 3.0, 0.0, 0.0]])


def scene(people=NOBODY):
    return Scene(np.zeros(3), people, np.zeros((2, 2)), False, False, np.empty((0, 2)))


@pytest.fixture
def window(monkeypatch):
    monkeypatch.setitem(os.environ, "SDL_VIDEODRIVER", "dummy")
    shown = Window()
    yield shown
    shown.close()
    pygame.display.quit()


def test_a_window_opens_with_its_first_frame_and_closes_cleanly(window):
    assert not pygame.display.get_init()
    frame = draw_scene(scene(people=PEOPLE), CONFIG, 480)
    window.show(frame, 1000)
    screen = pygame.display.get_surface()
    assert screen.get_size() == (480, frame.shape[0])
    np.testing.assert_array_equal(pygame.surfarray.array3d(screen).transpose(1, 0, 2), frame)
    window.close()
    window.close()
    assert not pygame.display.get_init()


def test_a_closed_window_opens_again(window):
    for _ in range(2):
        window.show(draw_scene(scene(), CONFIG, 480), 1000)
        window.close()
    assert not window.closed


def test_a_window_takes_the_size_of_its_frame(window):
    for width in (480, 640):
        window.show(draw_scene(scene(), CONFIG, width), 1000)
        assert pygame.display.get_surface().get_width() == width


def test_a_window_keeps_the_pace(window):
    frame = draw_scene(scene(), CONFIG, 480)
    window.show(frame, 50)
    start = pygame.time.get_ticks()
    for _ in range(5):
        window.show(frame, 50)
    assert pygame.time.get_ticks() - start >= 5 * 20 - 15


def test_a_window_that_the_user_closed_stays_closed(window):
    frame = draw_scene(scene(), CONFIG, 480)
    window.show(frame, 1000)
    pygame.event.post(pygame.event.Event(pygame.QUIT))
    window.show(frame, 1000)
    assert window.closed
    window.show(frame, 1000)
    assert not pygame.display.get_init()


def test_a_picture_is_the_same_while_a_window_is_open(window):
    frame = draw_scene(scene(people=PEOPLE), CONFIG, 480)
    window.show(frame, 1000)
    assert np.array_equal(draw_scene(scene(people=PEOPLE), CONFIG, 480), frame)


# --- no display ----------------------------------------------------------------------------------


@pytest.mark.parametrize("driver", ["offscreen", "dummy"])
def test_a_window_that_nobody_would_see_is_an_error(window, monkeypatch, driver):
    pygame.display.init()  # now, as the dummy: what SDL falls back on differs between machines
    monkeypatch.delitem(os.environ, "SDL_VIDEODRIVER")
    monkeypatch.setattr(pygame.display, "get_driver", lambda: driver)
    with pytest.raises(NoDisplayError, match=r"no display was found.*render_mode='rgb_array'"):
        window.show(np.zeros((48, 64, 3), dtype=np.uint8), 1000)
    assert not pygame.display.get_init()
    assert window.keys() == set()


def test_an_unseen_window_opens_for_who_asks_for_it(window, monkeypatch):
    monkeypatch.setitem(os.environ, "SDL_VIDEODRIVER", "offscreen")
    window.show(np.zeros((48, 64, 3), dtype=np.uint8), 1000)
    assert pygame.display.get_init()


def test_a_driver_that_does_not_work_is_the_same_error(window, monkeypatch):
    monkeypatch.setitem(os.environ, "SDL_VIDEODRIVER", "moon")
    with pytest.raises(NoDisplayError, match=r"no display was found \(.*moon.*\)"):
        window.show(np.zeros((48, 64, 3), dtype=np.uint8), 1000)
    assert not pygame.display.get_init()


# --- the keys ------------------------------------------------------------------------------------


def post(kind, *keys):
    for key in keys:
        pygame.event.post(pygame.event.Event(kind, key=key))


@pytest.fixture
def shown(window):
    window.show(np.zeros((48, 64, 3), dtype=np.uint8), 1000)
    pygame.event.clear()
    return window


def test_keys_are_named_as_long_as_they_are_held(shown):
    assert shown.keys() == set()
    post(pygame.KEYDOWN, pygame.K_UP, pygame.K_LEFT, pygame.K_SPACE, pygame.K_r, pygame.K_ESCAPE)
    for _ in range(2):
        assert shown.keys() == {"up", "left", "space", "r", "escape"}
    post(pygame.KEYUP, pygame.K_UP, pygame.K_r, pygame.K_SPACE, pygame.K_ESCAPE)
    assert shown.keys() == {"left"}


def test_a_tap_between_two_calls_is_not_missed_and_counts_once(shown):
    post(pygame.KEYDOWN, pygame.K_r)
    post(pygame.KEYUP, pygame.K_r)
    shown.show(np.zeros((48, 64, 3), dtype=np.uint8), 1000)
    assert shown.keys() == {"r"}
    assert shown.keys() == set()


def test_a_window_without_a_frame_has_no_keys(window):
    assert window.keys() == set()
    assert not window.closed


def test_keys_are_let_go_when_the_window_closes(shown):
    post(pygame.KEYDOWN, pygame.K_UP)
    shown.keys()
    shown.close()
    assert shown.keys() == set()


def test_asking_for_keys_notices_that_the_user_closed_the_window(shown):
    pygame.event.post(pygame.event.Event(pygame.QUIT))
    shown.keys()
    assert shown.closed
