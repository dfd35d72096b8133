"""The window of `human` mode, and the keys that are pressed in it."""

from __future__ import annotations

import os

import numpy as np
import pygame
from numpy.typing import NDArray

UNSEEN = ("offscreen", "dummy")
"""SDL's drivers whose windows nobody can see; it takes one where it finds no display."""


class NoDisplayError(RuntimeError):
    """There is no display on which a window could open."""


class Window:
    """A window that opens with its first frame; only here is a display touched."""

    def __init__(self, caption: str = "SocialCorridor") -> None:
        """Remember the caption; nothing opens yet."""
        self._caption = caption
        self._clock = pygame.time.Clock()
        self._open = False
        self._closed = False
        self._held: set[str] = set()
        self._tapped: set[str] = set()

    @property
    def closed(self) -> bool:
        """Whether the person in front of it has closed it; then `show` does nothing."""
        return self._closed

    def keys(self) -> set[str]:
        """Names of the keys that are held or were tapped since the last call.

        The names are pygame's: "up", "down", "left", "right", "space", "escape", "r", ...
        """
        self._listen()
        keys = self._held | self._tapped
        self._tapped.clear()
        return keys

    def show(self, frame: NDArray[np.uint8], fps: float) -> None:
        """Show a frame, and wait until it is time for it.

        Args:
            frame: (h, w, 3) RGB, as from `draw_scene`.
            fps: Frames per second to keep to.

        Raises:
            NoDisplayError: No display was found, and SDL_VIDEODRIVER does not say that an unseen
                one will do.
        """
        if self._closed:
            return
        screen = self._screen((frame.shape[1], frame.shape[0]))
        picture = pygame.image.frombuffer(
            np.ascontiguousarray(frame).data, screen.get_size(), "RGB"
        )
        screen.blit(picture, (0, 0))
        pygame.display.flip()
        self._listen()
        self._clock.tick(fps)

    def close(self) -> None:
        """Close the window; closing twice does no harm."""
        if self._open:
            pygame.display.quit()
            self._open = False
            self._held.clear()

    def _listen(self) -> None:
        """Take in what happened to keys and window since the last time."""
        if not self._open:
            return
        for event in pygame.event.get():
            if event.type == pygame.KEYDOWN:
                name = pygame.key.name(event.key)
                self._held.add(name)
                self._tapped.add(name)
            elif event.type == pygame.KEYUP:
                self._held.discard(pygame.key.name(event.key))
            elif event.type == pygame.QUIT:
                self._closed = True
        if self._closed:
            self.close()

    def _screen(self, size: tuple[int, int]) -> pygame.Surface:
        """The window's surface, opened or resized where needed."""
        screen = pygame.display.get_surface() if self._open else None
        if screen is None or screen.get_size() != size:
            screen = _opened(size)
            pygame.display.set_caption(self._caption)
            self._open = True
        return screen


def _opened(size: tuple[int, int]) -> pygame.Surface:
    """A window of that size, which somebody can see unless SDL_VIDEODRIVER says otherwise."""
    try:
        pygame.display.init()
        screen = pygame.display.set_mode(size)
    except pygame.error as error:
        pygame.display.quit()
        raise _no_display(f" ({error})") from None
    if pygame.display.get_driver() in UNSEEN and not os.environ.get("SDL_VIDEODRIVER"):
        pygame.display.quit()
        raise _no_display()
    return screen


def _no_display(why: str = "") -> NoDisplayError:
    """What is wrong and what to do."""
    return NoDisplayError(
        f"no display was found{why}, so nobody would see the window: use render_mode='rgb_array', "
        "or set SDL_VIDEODRIVER=dummy if nobody is to see it"
    )
