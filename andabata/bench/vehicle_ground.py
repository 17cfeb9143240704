"""Drives of all plants over what natural ground has: relief, kerbs, roots, stems and plants.

Each plant drives straight on for ten seconds from the same place; the ends are compared.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import get_args

import numpy as np

from andabata.bench.table import Row
from andabata.machine.kinematics import SkidSteer
from andabata.machine.plants import Plant, available_plants
from andabata.machine.robot import RobotModel
from andabata.machine.vehicle import make_vehicle
from terrain.classes import SemanticClass
from terrain.heightfield import Heightfield
from terrain.objects import SceneObject, box, rod
from terrain.plants import root
from worlds.fields import plain_world
from worlds.kerbs import Strip, kerbstones, raised
from worlds.rough_ground import RoughnessConfig, refined, rough_ground
from worlds.world import Start, World

_AHEAD = 1.5
"""Distance of what is in the way [m]."""

_CELL, _CELLS = 0.25, 3
"""Cell of smooth ground [m], and number of cells of rough ground along its edge."""

_PERIODS, _TICKS = 100, 10
"""Number of control periods of a drive, and of ticks of each."""


@dataclass(frozen=True)
class GroundCase:
    """Ground that robots drive over.

    Attributes:
        name: Kind of ground, in words.
        size: Its size, in the unit of the name.
        world: Ground with it.
    """

    name: str
    size: float
    world: World


def ground_cases() -> Iterator[GroundCase]:
    """Yield all cases, from relief to plants."""
    for clods in (0.01, 0.02, 0.03):
        yield GroundCase("clods, rms [m]", clods, _rough(clods))
    for height in (0.03, 0.06, 0.1):
        yield GroundCase("kerb [m]", height, _kerb(height))
    for height in (0.045, 0.065):
        course = np.array([[_AHEAD, -1.5], [_AHEAD, 0.0], [_AHEAD, 1.5]])
        yield GroundCase("root [m]", height, _flat(*root(_ground(), course, height)))
    for thick in (0.02, 0.06, 0.2):
        foot, tip = (_AHEAD, 0.1, -0.1), (_AHEAD + 0.05, 0.1, 1.5)
        stem = rod(SemanticClass.TRUNK, foot, tip, thick / 2)
        yield GroundCase("stem [m]", thick, _flat(stem))
    for kind, height in (
        (SemanticClass.HIGH_GRASS, 0.6),
        (SemanticClass.THICKET, 0.6),
        (SemanticClass.BUSH, 1.0),
    ):
        name = kind.name.lower().replace("_", " ")
        yield GroundCase(f"{name}, height [m]", height, _planted(kind, height, 0.0))
    for slope in (20.0, 28.0):
        yield GroundCase("bush uphill [deg]", slope, _planted(SemanticClass.BUSH, 9.0, slope))


def ground_drives(robot: RobotModel, seed: int) -> list[Row]:
    """Return for each case how far each installed plant gets, whether it touches, and the work.

    Plants that are not installed are left out.

    Args:
        robot: Body to drive.
        seed: Seed of the kinematic plant's slip.
    """
    rows: list[Row] = []
    for case in ground_cases():
        row: Row = {"ground": case.name, "size": case.size}
        work: Row = {}
        for plant in available_plants():
            end, touched, joules = _drive(case.world, robot, plant, seed)
            row |= {f"{plant}_m": end, f"{plant}_contact": touched}
            if joules is not None:
                work[f"{plant}_J"] = joules
        rows.append(row | work)
    return rows


def ground_table(rows: list[Row]) -> list[Row]:
    """Return rows for people: the plants that touch something in one column.

    Args:
        rows: Result of ``ground_drives``.
    """
    table = []
    for row in rows:
        plants = [plant for plant in get_args(Plant) if f"{plant}_m" in row]
        touching = [plant for plant in plants if row[f"{plant}_contact"]]
        short: Row = {"ground": row["ground"], "size": row["size"]}
        short |= {f"{plant}_m": row[f"{plant}_m"] for plant in plants}
        short["contact"] = "all" if len(touching) == len(plants) else ", ".join(touching) or "none"
        table.append(short | {key: row[key] for key in row if key.endswith("_J")})
    return table


def _drive(
    world: World, robot: RobotModel, plant: Plant, seed: int
) -> tuple[float, bool, float | None]:
    """Return the distance from the start [m], if something was touched, and the work [J]."""
    vehicle = make_vehicle(plant, world, robot, np.random.default_rng(seed))
    vehicle.place(Start(0.0, 0.0, 0.0))
    wheels, touched = SkidSteer(robot).wheel_speeds(robot.speed, 0.0), False
    for _ in range(_PERIODS):
        vehicle.drive(wheels, _TICKS)
        touched |= vehicle.state.collided
    state = vehicle.state
    vehicle.close()
    return float(np.hypot(*state.pose.position[:2])), touched, state.work


def _ground(slope_deg: float = 0.0) -> Heightfield:
    """Return smooth ground of 16 m that rises to the east."""
    x = np.arange(-8.0, 8.0 + _CELL / 2, _CELL)
    rise = np.tan(np.deg2rad(slope_deg)) * x
    return Heightfield(np.tile(rise[:, None], (1, len(x))).astype(np.float32), _CELL)


def _flat(*objects: SceneObject) -> World:
    """Return level ground with objects."""
    return plain_world("ground", _ground(), objects)


def _rough(clods: float) -> World:
    """Return level ground with clods."""
    ground = _ground()
    surface = np.zeros(tuple(n - 1 for n in ground.heights.shape), dtype=np.uint8)
    fine, surface = refined(ground, surface, _CELLS)
    config, rng = RoughnessConfig(clods=clods), np.random.default_rng(0)
    return plain_world("ground", rough_ground(fine, surface, config, 0.5, rng))


def _kerb(height: float) -> World:
    """Return level ground with a raised strip across the way."""
    ground = _ground()
    fine, half = ground.refined(_CELLS), 1.3
    line = np.array([[_AHEAD + half, y] for y in np.arange(-6.0, 6.1, 1.5)])
    strips = [Strip(line, half, height)]
    heights = (fine.heights + raised(fine, strips, [])).astype(np.float32)
    stones = tuple(kerbstones(ground, strips, [], fine.cell))
    return plain_world("ground", Heightfield(heights, fine.cell), stones)


def _planted(kind: SemanticClass, height: float, slope_deg: float) -> World:
    """Return ground on which plants begin 0.5 m ahead; on a slope they hold the whole body."""
    plants = box(kind, (3.5, 0.0, 0.0), (6.0, 6.0, 2 * height))
    return plain_world("ground", _ground(slope_deg), (plants,))
