"""Scene of a drive in a room: walls, robot, beams, support points, movers, path."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from andabata.evaluation.room_moments import RoomMoment, WatchedDrive
from andabata.viewer.offroad_scene import light
from terrain.classes import SemanticClass
from terrain.objects import SceneObject, box, frustum, hull
from worlds.rooms.room import Room

if TYPE_CHECKING:
    import viser

_ROOT = "/room"
_FLOOR, _WALL, _ROBOT, _NOSE = (238, 234, 226), (150, 142, 130), (240, 160, 30), (45, 50, 60)
_BEAM, _MISS, _SUPPORT, _MOVER = (225, 170, 20), (205, 215, 220), (123, 63, 160), (209, 72, 63)
_PATH, _GOAL = (208, 0, 111), (0, 71, 200)

_HEIGHT = 0.35
"""Height of what is solid, of the robot and of movers [m]."""

_MOST_BEAMS = 180
"""Largest number of beams that are drawn; all of them have a point at their end."""

_SUPPORT_SIZES = (0.05, 0.16)
"""Radius of a support point of one feature, and the largest [m]."""

ROOM_LAYERS = ("beams", "support points", "movers", "path")
"""Names of what can be shown and hidden."""


class RoomScene:
    """Draws the moments of one drive after another."""

    def __init__(self, server: "viser.ViserServer") -> None:
        """Light an empty scene."""
        self._server, self._scene = server, server.scene
        light(server.scene)
        self._hidden: set[str] = set()
        self._drive: WatchedDrive | None = None

    def load(self, drive: WatchedDrive) -> None:
        """Draw the room of another drive."""
        scene, self._drive = self._scene, drive
        with self._server.atomic():
            scene.remove_by_name(_ROOT)
            scene.add_frame(_ROOT, show_axes=False)
            self._add_room(drive.room)
            self._add_robot(drive.outline)
            x, y = drive.task.goal
            scene.add_cylinder(
                f"{_ROOT}/goal", radius=0.12, height=0.02, color=_GOAL, position=(x, y, 0.02)
            )
            scene.add_label(f"{_ROOT}/goal/name", "goal", position=(0.0, 0.0, 0.3))
            movers = drive.moments[0].movers
            self._movers = [
                scene.add_cylinder(
                    f"{_ROOT}/movers/{k}",
                    radius=1.0,
                    height=_HEIGHT,
                    color=_MOVER,
                    cast_shadow=False,
                    visible=False,
                )
                for k in range(len(movers))
            ]
            none = np.zeros((0, 2, 3), dtype=np.float32)
            self._path = scene.add_line_segments(f"{_ROOT}/path", none, _PATH, thickness=0.04)
            self._beams = scene.add_line_segments(f"{_ROOT}/beams", none, _BEAM, thickness=0.008)
        far = max(drive.room.half)
        self._server.initial_camera.position = (-0.1 * far, -1.4 * far, 1.9 * far)
        self._server.initial_camera.look_at = (0.35 * far, 0.0, 0.0)
        for client in self._server.get_clients().values():
            client.camera.position = (-0.1 * far, -1.4 * far, 1.9 * far)
            client.camera.look_at = (0.35 * far, 0.0, 0.0)

    def show(self, layer: str, visible: bool) -> None:
        """Show or hide a layer, one of ``ROOM_LAYERS``, from the next moment on."""
        self._hidden.discard(layer)
        if not visible:
            self._hidden.add(layer)

    def draw(self, number: int) -> None:
        """Draw a moment of the drive by its number."""
        assert self._drive is not None
        moment = self._drive.moments[number]
        with self._server.atomic():
            x, y, yaw = moment.pose.tolist()
            self._robot.position = (x, y, 0.0)
            self._robot.wxyz = (np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2))
            self._draw_beams(moment)
            self._draw_support(moment)
            for handle, (mx, my, radius) in zip(self._movers, moment.movers.tolist(), strict=True):
                handle.visible = radius > 0.0 and "movers" not in self._hidden
                if radius > 0.0:
                    handle.position = (mx, my, _HEIGHT / 2)
                    handle.scale = (radius, radius, 1.0)
            path = np.array([each.pose for each in self._drive.moments[: number + 1]])
            path[:, 2] = 0.03
            self._path.visible = "path" not in self._hidden
            self._path.points = np.stack([path[:-1], path[1:]], axis=1).astype(np.float32)
        self._server.flush()

    def _draw_beams(self, moment: RoomMoment) -> None:
        """Draw some of the beams, and a point at the end of each that met something."""
        visible = "beams" not in self._hidden
        every = -(-len(moment.ends) // _MOST_BEAMS)
        ends = _lifted(moment.ends[::every], 0.2)
        lines = np.stack([np.broadcast_to(_lifted(moment.origin[None], 0.2), ends.shape), ends], 1)
        colours = np.where(moment.hits[::every, None], np.array(_BEAM), np.array(_MISS))
        self._beams.points = lines.astype(np.float32)
        self._beams.colors = np.repeat(colours[:, None], 2, axis=1).astype(np.uint8)
        self._beams.visible = visible
        hits = _lifted(moment.ends[moment.hits], 0.2)
        self._scene.add_point_cloud(
            f"{_ROOT}/hits",
            hits.astype(np.float32),
            np.array(_BEAM, dtype=np.uint8),
            point_size=0.035,
            precision="float32",
            visible=visible,
        )

    def _draw_support(self, moment: RoomMoment) -> None:
        """Draw support points, the larger the more features they give."""
        name, support = f"{_ROOT}/support", moment.support
        if support is None or not len(support.places) or "support points" in self._hidden:
            if support is not None:
                self._scene.remove_by_name(name)
            return
        least, most = _SUPPORT_SIZES
        sizes = (least * np.sqrt(support.counts)).clip(max=most)
        balls = _lifted(support.places, 0.2)[:, None] + sizes[:, None, None] * _BALL.vertices
        first = len(_BALL.vertices) * np.arange(len(sizes), dtype=np.uint32)
        self._scene.add_mesh_simple(
            name,
            balls.reshape(-1, 3),
            (first[:, None, None] + _BALL.triangles).reshape(-1, 3),
            color=_SUPPORT,
            material="toon3",
            cast_shadow=False,
            receive_shadow=False,
        )

    def _add_room(self, room: Room) -> None:
        """Draw floor, boxes, posts and outlines."""
        half_x, half_y = room.half
        floor = box(SemanticClass.GROUND, (0.0, 0.0, -0.01), (2 * half_x, 2 * half_y, 0.02))
        solids = [_wall(row) for row in room.boxes.tolist()]
        solids += [
            frustum(SemanticClass.POST, (x, y, 0.0), (radius, radius), _HEIGHT, 16)
            for x, y, radius in room.circles.tolist()
        ]
        for name, parts, colour in (("floor", [floor], _FLOOR), ("solid", solids, _WALL)):
            vertices, triangles = merged(parts)
            self._scene.add_mesh_simple(
                f"{_ROOT}/{name}",
                vertices,
                triangles,
                color=colour,
                material="toon3",
                cast_shadow=False,
                receive_shadow=False,
            )
        if len(room.edges):
            # Outlines may be of any form: their edges stand as thin walls.
            vertices, triangles = edge_walls(room.edges)
            self._scene.add_mesh_simple(
                f"{_ROOT}/outlines",
                vertices,
                triangles,
                color=_WALL,
                material="toon3",
                side="double",
                cast_shadow=False,
                receive_shadow=False,
            )

    def _add_robot(self, outline: NDArray[np.float64]) -> None:
        """Draw the robot as a prism over its outline, with a nose."""
        self._robot = self._scene.add_frame(f"{_ROOT}/robot", show_axes=False)
        corners = np.concatenate([_lifted(outline, 0.02), _lifted(outline, 0.3)])
        body = hull(SemanticClass.GROUND, corners)
        self._scene.add_mesh_simple(
            f"{_ROOT}/robot/body", body.vertices, body.triangles, color=_ROBOT, cast_shadow=False
        )
        reach = float(outline[:, 0].max())
        self._scene.add_box(
            f"{_ROOT}/robot/nose",
            _NOSE,
            dimensions=(reach, 0.06, 0.05),
            position=(reach / 2, 0.0, 0.32),
            cast_shadow=False,
        )


_BALL = hull(
    SemanticClass.GROUND,
    np.array(
        [
            [np.cos(a) * np.cos(b), np.sin(a) * np.cos(b), np.sin(b)]
            for b in (-1.5707, -0.8, 0.0, 0.8, 1.5707)
            for a in np.linspace(0, 2 * np.pi, 8, endpoint=False) + b
        ]
    ),
)
"""Ball of radius 1 m."""


def _lifted(places: NDArray[np.float64], height: float) -> NDArray[np.float64]:
    """Return places in the plane at a height [m], shape (k, 3)."""
    return np.column_stack([places, np.full(len(places), height)])


def _wall(row: list[float]) -> SceneObject:
    """Return a box of a room as a solid."""
    x_low, y_low, x_high, y_high = row
    middle = ((x_low + x_high) / 2, (y_low + y_high) / 2, _HEIGHT / 2)
    return box(SemanticClass.WALL, middle, (x_high - x_low, y_high - y_low, _HEIGHT))


def merged(parts: list[SceneObject]) -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
    """Return vertices [m] and triangles of several solids together."""
    firsts = np.cumsum([0, *(len(part.vertices) for part in parts)])[:-1]
    triangles = [
        part.triangles + np.uint32(first) for part, first in zip(parts, firsts, strict=True)
    ]
    return np.concatenate([part.vertices for part in parts]), np.concatenate(triangles)


def edge_walls(edges: NDArray[np.float64]) -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
    """Return edges of outlines, rows of x, y at the begin and at the end [m], as upright walls."""
    begins, ends = edges[:, :2], edges[:, 2:]
    corners = [_lifted(part, height) for height in (0.0, _HEIGHT) for part in (begins, ends)]
    vertices = np.stack(corners, axis=1).reshape(-1, 3).astype(np.float32)
    square = np.array([[0, 1, 3], [0, 3, 2]], dtype=np.uint32)
    first = 4 * np.arange(len(edges), dtype=np.uint32)
    return vertices, (first[:, None, None] + square).reshape(-1, 3)
