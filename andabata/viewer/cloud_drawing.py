"""Drawing of laser points: each part of the cloud is sent once, and moved with ``odom``."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from andabata.report.class_colours import CLASS_COLOURS
from andabata.report.drive_frames import DriveFrame
from traversability.cloud import PointCloud, joined

if TYPE_CHECKING:
    import viser

COLOURINGS = ("class", "height", "age")
"""Names of what the colour of a point tells: true class, height over the robot's foot, time."""

_HEIGHTS = (-1.0, 2.0)
"""Heights over the robot's foot with the first and the last colour [m]."""

_SIZE = 0.03
"""Edge of a point [m]."""

_FAINT, _BRIGHT = np.array([35, 60, 150]), np.array([255, 210, 40])
"""Colours of the oldest and of the newest points."""


class CloudDrawing:
    """Laser points of the last half turn, in as many nodes as there were frames meanwhile.

    A part never changes, so its points travel to the browser once, with all others that came since
    the last frame; afterwards the node of ``odom`` moves under all of them.
    """

    def __init__(self, scene: "viser.SceneApi", root: str, most: int) -> None:
        """Begin without points.

        Args:
            scene: Scene to draw in.
            root: Name of the node of ``odom``.
            most: Largest number of points that are shown.
        """
        self._scene, self._root, self._most = scene, root, most
        self._shown: list[tuple[tuple[PointCloud, ...], viser.PointCloudHandle]] = []
        self._spare: list[viser.PointCloudHandle] = []
        self._colouring, self._visible, self._number = COLOURINGS[0], True, 0

    def colour_by(self, colouring: str) -> None:
        """Colour the points anew, from the next frame on.

        Args:
            colouring: One of ``COLOURINGS``.
        """
        self._colouring = colouring
        self._keep(set())

    def show(self, visible: bool) -> None:
        """Show or hide the points."""
        self._visible = visible
        for _, handle in self._shown:
            handle.visible = visible

    def draw(self, frame: DriveFrame) -> None:
        """Draw the points of a frame: new parts are sent, those that have gone are hidden."""
        self._keep({id(part) for part in frame.parts})
        known = {id(part) for parts, _ in self._shown for part in parts}
        # What was sent together goes together, as soon as its oldest part has gone.
        last = max((k for k, part in enumerate(frame.parts) if id(part) in known), default=-1)
        new = frame.parts[last + 1 :]
        if new:
            share = min(self._most / max(sum(len(part) for part in frame.parts), 1), 1.0)
            self._shown.append((new, self._send(joined(new), share, frame)))

    def _keep(self, wanted: set[int]) -> None:
        """Hide all nodes of which a part is not wanted, by its identity."""
        kept = []
        for parts, handle in self._shown:
            if all(id(part) in wanted for part in parts):
                kept.append((parts, handle))
            else:
                handle.visible = False
                self._spare.append(handle)
        self._shown = kept

    def _send(self, part: PointCloud, share: float, frame: DriveFrame) -> "viser.PointCloudHandle":
        """Send a share of a part's points, from the robot: half precision is enough around it."""
        chosen = thinned(len(part), share)
        middle = frame.odometry.position
        local = (part.points[chosen] - middle.astype(np.float32)).astype(np.float16)
        colours = self._colours(part, chosen, frame)
        name = f"{self._root}/cloud/{self._number}"
        if self._spare:
            # The node of a part that has gone is made anew under its name: points and colours of
            # another number must never be seen with each other.
            name = self._spare.pop().name
        else:
            self._number += 1
        return self._scene.add_point_cloud(
            name,
            local,
            colours,
            point_size=_SIZE,
            point_shape="circle",
            point_shading="flat",
            position=middle,
            visible=self._visible,
        )

    def _colours(
        self, part: PointCloud, chosen: NDArray[np.int64], frame: DriveFrame
    ) -> NDArray[np.uint8]:
        """Return the colours of some of a part's points, uint8, shape (k, 3)."""
        if self._colouring == "class" and part.classes is not None:
            return CLASS_COLOURS[part.classes[chosen]]
        if self._colouring == "age" and part.stamps is not None:
            share = (part.stamps[chosen] % _CYCLE) / _CYCLE
            return (_FAINT + share[:, None] * (_BRIGHT - _FAINT)).astype(np.uint8)
        heights = part.points[chosen, 2].astype(np.float64) - frame.odometry.position[2]
        return height_colours(heights)


_CYCLE = 3.3
"""Time after which the colours of time begin anew [s]: about half a turn of the head."""


def thinned(count: int, share: float) -> NDArray[np.int64]:
    """Return the numbers of a share of some points, evenly spaced, at least one.

    Args:
        count: Number of points.
        share: Share of them, from 0 to 1.
    """
    kept = min(max(int(count * share), 1), count)
    return np.arange(kept, dtype=np.int64) * count // max(kept, 1)


def height_colours(heights: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Return colours from blue over green and yellow to red for heights [m], shape (n, 3)."""
    low, high = _HEIGHTS
    share = ((heights - low) / (high - low)).clip(0.0, 1.0)
    knots = np.linspace(0.0, 1.0, len(_RAMP))
    return np.stack([np.interp(share, knots, _RAMP[:, k]) for k in range(3)], axis=1).astype(
        np.uint8
    )


_RAMP = np.array([(48, 60, 160), (40, 140, 190), (90, 180, 90), (240, 200, 60), (215, 50, 40)])
"""Colours of heights, from the lowest to the highest."""
