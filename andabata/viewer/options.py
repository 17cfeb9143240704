"""Choices of who watches a drive."""

from dataclasses import dataclass

from andabata.viewer.server import DEFAULT_PORT

DEFAULT_POINTS = 32_000
"""Largest number of points that are shown: those of the paper's clouds."""


@dataclass(frozen=True)
class ViewConfig:
    """Choices of who watches a drive.

    Attributes:
        port: Port that is tried first; 0 takes any that is free.
        points: Largest number of laser points that are shown.
        speed: Simulated or recorded seconds in a second; infinite waits for nothing.
        is_paused: True to begin with a pause.
        waits: True to begin when the first page is open.
        allow_commands: True if pages may command a real robot; the address has a token then.
    """

    port: int = DEFAULT_PORT
    points: int = DEFAULT_POINTS
    speed: float = 1.0
    is_paused: bool = False
    waits: bool = False
    allow_commands: bool = False
