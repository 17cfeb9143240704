"""Moving pictures of drives in rooms: robots of the first tasks side by side, with their trails.

What moves in a room moves on its own in each drive, so that a panel with movers has one drive.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from andabata.evaluation.room_drives import RoomAttempt
from andabata.report.plots.drive_traces import COLOURS
from andabata.report.plots.room_drawing import draw_room
from andabata.report.plots.room_movers import MOVER_COLOUR, NO_MOVERS, Movers
from andabata.tasks.terminations import Outcome
from worlds.rooms.room import Room

MOST_DRIVES = 6
"""Largest number of robots in a panel."""

RATE = 12.0
"""Number of pictures a second [Hz]."""

_SIZE = 3.3
"""Width of a panel [inches]."""

_FRAMES = 80
"""Largest number of pictures."""

_STANDING = 8
"""Number of pictures at the end that show how the drives ended."""

_FAILED = (209, 72, 63)
"""Colour of a robot that failed."""


def room_film(
    drives: Mapping[str, Sequence[RoomAttempt]],
    room: Room,
    radius: float,
    movers: Mapping[str, Movers] = NO_MOVERS,
) -> list[Image.Image]:
    """Return the pictures of drives from above, a panel a driver.

    All drives begin together, and each robot stays where it ended.

    Args:
        drives: Drives of the same tasks by driver; the first ones are shown.
        room: Room of the drives.
        radius: Radius of the robot [m].
        movers: Movers of a driver's first drive, which is then the only one that is shown.
    """
    background, places = _panels(list(drives), room)
    shown = [list(some)[: 1 if name in movers else MOST_DRIVES] for name, some in drives.items()]
    longest = max(len(drive.path) for some in shown for drive in some)
    count = min(longest, _FRAMES)
    steps = np.linspace(0, longest - 1, count).round().astype(int).tolist()
    pictures = []
    for step in [*steps, *[longest - 1] * _STANDING]:
        picture = background.copy()
        pen = ImageDraw.Draw(picture)
        for name, place, some in zip(drives, places, shown, strict=True):
            if name in movers:
                _draw_movers(pen, place, movers[name][min(step, len(movers[name]) - 1)])
            for number, drive in enumerate(some):
                _draw_robot(pen, place, drive, step, radius, COLOURS[number % len(COLOURS)])
        pictures.append(picture)
    return pictures


Place = NDArray[np.float64]
"""Rows that take x, y and 1 to column and row of a picture [pixels], shape (2, 3)."""


def _panels(names: Sequence[str], room: Room) -> tuple[Image.Image, list[Place]]:
    """Return a picture of empty rooms side by side, and where each of them lies."""
    height = _SIZE * room.half[1] / room.half[0] + 0.4
    figure = Figure(figsize=(_SIZE * len(names), height), layout="constrained")
    canvas = FigureCanvasAgg(figure)
    axes = figure.subplots(1, len(names), squeeze=False)[0]
    for one, name in zip(axes, names, strict=True):
        draw_room(one, room)
        one.set_title(name, fontsize=9)
        one.set_xlabel("")
        one.set_ylabel("")
    canvas.draw()
    pixels = np.asarray(canvas.buffer_rgba())
    return Image.fromarray(pixels).convert("RGB"), [_place(one, len(pixels)) for one in axes]


def _place(axes: Any, height: int) -> Place:  # noqa: ANN401 - matplotlib's transforms.
    """Return the map from metres to pixels, whose rows count from above."""
    origin, east, north = axes.transData.transform([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)])
    (u, v), right, up = origin, east[0] - origin[0], north[1] - origin[1]
    return np.array([[right, 0.0, u], [0.0, -up, height - v]])


def _draw_movers(pen: ImageDraw.ImageDraw, place: Place, movers: Movers) -> None:
    """Draw the movers of a moment that are there.

    Args:
        pen: Pen on the picture.
        place: Place of the panel.
        movers: x, y and radius of each mover [m], shape (m, 3).
    """
    for x, y, radius in movers[movers[:, 2] > 0]:
        (column, row), size = place @ [x, y, 1.0], radius * place[0, 0]
        pen.ellipse((column - size, row - size, column + size, row + size), fill=MOVER_COLOUR)


def _draw_robot(
    pen: ImageDraw.ImageDraw,
    place: Place,
    drive: RoomAttempt,
    step: int,
    radius: float,
    colour: str,
) -> None:
    """Draw a robot at a step with its trail and its goal; one that failed turns red."""
    rgb = tuple(round(255 * part) for part in to_rgb(colour))
    over = step >= len(drive.path) - 1
    path = drive.path[: step + 1, :2]
    corners = np.column_stack([path, np.ones(len(path))]) @ place.T
    if len(corners) > 1:
        pen.line([(float(x), float(y)) for x, y in corners], fill=rgb, width=2)
    goal_x, goal_y = place @ [*drive.detail.task.goal, 1.0]
    pen.line((goal_x - 4, goal_y, goal_x + 4, goal_y), fill=rgb, width=2)
    pen.line((goal_x, goal_y - 4, goal_x, goal_y + 4), fill=rgb, width=2)
    x, y = corners[-1]
    size = max(radius * place[0, 0], 2.0)
    body = _FAILED if over and drive.outcome is not Outcome.GOAL else rgb
    pen.ellipse((x - size, y - size, x + size, y + size), fill=body)
    yaw = float(drive.path[min(step, len(drive.path) - 1), 2])
    pen.line((x, y, x + size * np.cos(yaw), y - size * np.sin(yaw)), fill=(255, 255, 255), width=2)
