"""What the study refuses to do for somebody, in words for a participant."""

from __future__ import annotations

from typing import Any

from polite.types import PoliteError


class RefusedError(PoliteError):
    """A request that is not granted."""

    def __init__(self, status: int, message: str, **more: Any) -> None:
        """Say why.

        Args:
            status: The HTTP status that means the same.
            message: A sentence for the participant.
            **more: What the page needs to go on.
        """
        super().__init__(message)
        self.status = status
        self.message = message
        self.more = more


class WithdrawnError(RefusedError):
    """A participant who is not in the study any more."""

    def __init__(self) -> None:
        """Say so."""
        super().__init__(
            410, "Your answers have been deleted, so you are not in this study any more."
        )
