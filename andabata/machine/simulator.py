"""Simulator of a robot in a world: plant and sensors on one clock, a control period at a time."""

import math
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field
from scipy.spatial.transform import Rotation

from andabata.machine.beams import BeamTables, sweeps_to_cloud
from andabata.machine.clock import TICK_HZ, TICKS_PER_STEP
from andabata.machine.drivetrain import Drivetrain
from andabata.machine.geo_reference import GeoReference
from andabata.machine.lidar import HorizontalScanner, LidarConfig, RotatingLidar
from andabata.machine.plants import Plant
from andabata.machine.pose import PoseTrack
from andabata.machine.proprioception import Proprioception, ProprioceptionConfig
from andabata.machine.reality import AS_BELIEVED, TrueConstants
from andabata.machine.robot import RobotModel
from andabata.machine.sensor_readings import SensorReadings, Sweeps, VehicleState, WheelSpeeds
from andabata.machine.vehicle import make_vehicle
from traversability.cloud import PointCloud
from traversability.grid import PolarGrid
from worlds.rays.scene import RayScene
from worlds.walking import Walkers
from worlds.world import Start, World

_TICKS = np.arange(1, TICKS_PER_STEP + 1)
"""Numbers of a control period's ticks after those before it."""


def reseed(stream: np.random.Generator, rng: np.random.Generator) -> None:
    """Seed a random stream from one draw of another.

    Args:
        stream: Stream that is seeded, in place.
        rng: Source of the seed.
    """
    stream.bit_generator.state = np.random.PCG64(int(rng.integers(2**63))).state


class SensingConfig(BaseModel):
    """Sensors of the robot.

    Attributes:
        scanner: Kind of scanner: ``rotating``, the vertical laser on its turning head, or
            ``horizontal``, the 32 beams of the curriculum's stage 1.
        lidar: Parameters of the rotating laser.
        grid: Polar grid whose sectors the horizontal beams point along.
        proprioception: Parameters of IMU, magnetometer, encoders and GNSS; None leaves them out.
        geo_reference: Datum of the map.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    scanner: Literal["rotating", "horizontal"] = "rotating"
    lidar: LidarConfig = Field(default_factory=LidarConfig)
    grid: PolarGrid = Field(default_factory=PolarGrid)
    proprioception: ProprioceptionConfig | None = Field(default_factory=ProprioceptionConfig)
    geo_reference: GeoReference = Field(default_factory=GeoReference)


class Simulator:
    """Robot in a world, with its plant and its sensors.

    Stamps count from the moment that the robot is put down; ``andabata.machine.clock`` says how
    they are computed.

    Attributes:
        vehicle: Plant of the robot.
        proprioception: Models of IMU, magnetometer, encoders and GNSS, or None.
        lidar: Model of the rotating laser; None with the horizontal scanner.
        walkers: Walkers of the world; None without any.
    """

    def __init__(
        self,
        world: World,
        rays: RayScene,
        robot: RobotModel,
        plant: Plant,
        sensing: SensingConfig,
        rng: np.random.Generator,
        reach: float = np.inf,
    ) -> None:
        """Build the plant in the world and mount the sensors.

        Args:
            world: Ground and objects.
            rays: Ray scene of the same world.
            robot: Parameters of the body.
            plant: Name of the plant: ``bullet`` (the reference), ``mujoco``, ``wheels`` or
                ``kinematic``.
            sensing: Parameters of the sensors.
            rng: Source of all noise of plant and sensors.
            reach: Range up to which returns have to be right [m]; see ``RotatingLidar``.
        """
        # Plant and laser have streams of their own, so that neither depends on the other's draws.
        self._rng, self._streams = rng, (np.random.default_rng(0), np.random.default_rng(0))
        slip, beams = self._streams
        self._reseed()
        self.vehicle = make_vehicle(plant, world, robot, slip)
        self.walkers = Walkers(world, TICK_HZ) if world.movers else None
        # Nobody appears out of nothing where the body is.
        self._reach = math.hypot(robot.length, robot.width) / 2
        self._track = PoseTrack()  # As the laser's mast has it.
        self._tick = 0
        self._drivetrain = Drivetrain()
        self._mast: Rotation | None = None
        self.proprioception: Proprioception | None = None
        if sensing.proprioception is not None:
            self.proprioception = Proprioception(
                sensing.proprioception, sensing.geo_reference, world.objects, robot
            )
        self._tables = BeamTables()
        self._many_beams = sensing.lidar.is_multibeam
        self.lidar: RotatingLidar | None = None
        self._scanner: HorizontalScanner | None = None
        if sensing.scanner == "rotating":
            self.lidar = RotatingLidar(rays, sensing.lidar, robot, beams, reach, self.walkers)
        else:
            self._scanner = HorizontalScanner(rays, sensing.grid, robot, beams, self.walkers)

    def reset(self, start: Start, constants: TrueConstants = AS_BELIEVED) -> SensorReadings:
        """Put the robot down at rest and return the readings before the first period.

        Args:
            start: Place and heading.
            constants: True constants of the robot; by default those that it believes.
        """
        self._reseed()
        self._drivetrain.reset(constants)
        tilt = constants.laser_tilt
        self._mast = Rotation.from_euler("xy", tilt) if any(tilt) else None
        if self.lidar is not None:
            self.lidar.reset(constants)
        self.vehicle.place(start)
        self._tick = 0
        if self.walkers is not None:
            self.walkers.reset((start.x, start.y), self._reach)
        self._track.clear()
        state = self.vehicle.state
        pose = np.concatenate([state.pose.position, state.pose.quaternion])
        self._track.extend(self._at_mast(np.array([[0.0, *pose]])))
        if self.proprioception is not None:
            self.proprioception.reset(pose, self._rng, constants)
        return self._sense(state, np.empty((0, 10)))

    def _at_mast(self, rows: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the poses of the body turned by the lean of the laser's mast.

        Args:
            rows: Rows of stamp [s], true x, y, z [m] and quaternion x, y, z, w, shape (k, 8).
        """
        if self._mast is None:
            return rows
        turned = (Rotation.from_quat(rows[:, 4:]) * self._mast).as_quat()
        return np.column_stack([rows[:, :4], turned])

    def _reseed(self) -> None:
        """Seed the streams of plant and laser."""
        for stream in self._streams:
            reseed(stream, self._rng)

    def step(self, wheels: WheelSpeeds, skip_scan: bool = False) -> SensorReadings:
        """Drive one control period and return its readings.

        Args:
            wheels: Commanded wheel speeds.
            skip_scan: True to leave the scanner out, which takes most of the time; ``sweeps``
                computes past ones.
        """
        # Ticks are counted in whole numbers and divided; see ``andabata.machine.clock``.
        rows = np.empty((TICKS_PER_STEP, 10))
        rows[:, 0] = (self._tick + _TICKS) / TICK_HZ
        walkers = None
        if self.walkers is not None:
            x, y = self.vehicle.state.pose.position[:2].tolist()
            walkers = self.walkers.step(TICKS_PER_STEP, (x, y), self._reach)
        targets = self._drivetrain.targets(wheels)
        rows[:, 1:] = self.vehicle.drive(targets, TICKS_PER_STEP, walkers)
        self._tick += TICKS_PER_STEP
        self._track.extend(self._at_mast(rows[:, :8]))
        return self._sense(self.vehicle.state, self._drivetrain.turned(rows), skip_scan)

    def _sense(
        self, state: VehicleState, rows: NDArray[np.float64], skip_scan: bool = False
    ) -> SensorReadings:
        """Sample the sensors for the period that ends with a state.

        Args:
            state: True state at the end of the period.
            rows: Rows of stamp [s], pose and wheel speeds at each tick, shape (k, 10).
            skip_scan: True to leave the scanner out.
        """
        sweeps = horizontal = None
        frames: tuple[PointCloud, ...] = ()
        begin = (self._tick - len(rows)) / TICK_HZ
        if self.lidar is not None and state.stamp > begin and not skip_scan:
            sweeps = self.lidar.sweeps(begin, state.stamp, self._track)
            if self._many_beams:
                frames, sweeps = (sweeps_to_cloud(sweeps, self._tables),), None
        if self._scanner is not None and not skip_scan:
            horizontal = self._scanner.ranges(state.pose)
        imu = encoders = mag = gnss = None
        if self.proprioception is not None and len(rows):
            imu, encoders, mag, gnss = self.proprioception.sample(rows)
        return SensorReadings(
            stamp=state.stamp,
            imu=imu,
            encoders=encoders,
            mag=mag,
            gnss=gnss,
            sweeps=sweeps,
            frames=frames,
            horizontal=horizontal,
            truth=state,
            true_track=rows[:, :8],
            walkers=None if self.walkers is None else self.walkers.track.now,
        )

    def sweeps(self, begin: float, end: float, tilt: Rotation | None = None) -> Sweeps:
        """Return the sweeps of the rotating laser in a past span, up to eight seconds back.

        Args:
            begin: Begin of the span [s].
            end: End of the span [s].
            tilt: Rotation ``R_base_laser`` of a laser that is not mounted level; None for level.

        Raises:
            ValueError: If the robot has no rotating laser.
        """
        if self.lidar is None:
            raise ValueError(
                "scanner: expected rotating, got horizontal; set sensing.scanner=rotating"
            )
        track = self._track if tilt is None else self._track.rotated(tilt)
        return self.lidar.sweeps(begin, end, track)

    def close(self) -> None:
        """Release the resources of the plant."""
        self.vehicle.close()
