"""One clock: the plant moves and the senses sample, one control period at a time."""

from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field
from scipy.spatial.transform import Rotation

from andabata.machine.beams import BeamTables, cloud_of_sweeps
from andabata.machine.clock import TICK_HZ, TICKS_PER_STEP
from andabata.machine.geo_reference import GeoReference
from andabata.machine.lidar import HorizontalScanner, LidarConfig, RotatingLidar
from andabata.machine.pose import PoseTrack
from andabata.machine.proprioception import Proprioception, ProprioceptionConfig
from andabata.machine.robot import RobotModel
from andabata.machine.sensor_readings import SensorReadings, Sweeps, VehicleState, WheelSpeeds
from andabata.machine.vehicle import Plant, make_vehicle
from traversability.cloud import PointCloud
from traversability.grid import PolarGrid
from worlds.rays import RayScene
from worlds.world import Start, World


def reseed(stream: np.random.Generator, rng: np.random.Generator) -> None:
    """Begin a stream of draws afresh, from one draw of ``rng``."""
    stream.bit_generator.state = np.random.PCG64(int(rng.integers(2**63))).state


class SensingConfig(BaseModel):
    """Which scanner the robot carries.

    Attributes:
        scanner: ``rotating``, the vertical laser on its turning head, or ``horizontal``, stage 1's
            32 beams.
        lidar: The rotating laser.
        grid: Where the horizontal beams point.
        proprioception: IMU, compass, encoders and GNSS; None leaves them out.
        geo_reference: Where on Earth the map lies.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    scanner: Literal["rotating", "horizontal"] = "rotating"
    lidar: LidarConfig = Field(default_factory=LidarConfig)
    grid: PolarGrid = Field(default_factory=PolarGrid)
    proprioception: ProprioceptionConfig | None = Field(default_factory=ProprioceptionConfig)
    geo_reference: GeoReference = Field(default_factory=GeoReference)


class Simulator:
    """A robot in a world. Stamps are whole ticks since it was put down, so they never drift.

    A stamp is divided, not multiplied, out of its tick: it survives nanoseconds and back unchanged.

    Attributes:
        vehicle: The plant.
        proprioception: IMU, compass, encoders and GNSS, None without them.
        lidar: The rotating laser, None with the horizontal scanner.
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
        """Build the plant in the world and mount the senses.

        Args:
            world: Where to drive.
            rays: The same world's ray scene.
            robot: The body.
            plant: ``bullet`` (the reference) or ``kinematic``.
            sensing: The scanner.
            rng: Every noise of plant and senses comes from here.
            reach: See ``RotatingLidar``.
        """
        # Plant and laser have streams of their own: what one draws changes nothing for the other.
        self._rng, self._streams = rng, (np.random.default_rng(0), np.random.default_rng(0))
        slip, beams = self._streams
        self._reseed()
        self.vehicle = make_vehicle(plant, world, robot, slip)
        self._track = PoseTrack()
        self._tick = 0
        self.proprioception: Proprioception | None = None
        if sensing.proprioception is not None:
            self.proprioception = Proprioception(
                sensing.proprioception, sensing.geo_reference, world.objects
            )
        self._tables = BeamTables()
        self._many_beams = sensing.lidar.is_multibeam
        self.lidar: RotatingLidar | None = None
        self._scanner: HorizontalScanner | None = None
        if sensing.scanner == "rotating":
            self.lidar = RotatingLidar(rays, sensing.lidar, robot, beams, reach)
        else:
            self._scanner = HorizontalScanner(rays, sensing.grid, robot, beams)

    def reset(self, start: Start) -> SensorReadings:
        """Put the robot down at rest and return what it senses before the first period."""
        self._reseed()
        self.vehicle.place(start)
        self._tick = 0
        self._track.clear()
        state = self.vehicle.state
        self._track.append(0.0, state.pose.position, state.pose.quaternion)
        if self.proprioception is not None:
            pose = np.concatenate([state.pose.position, state.pose.quaternion])
            self.proprioception.reset(pose, self._rng)
        return self._sense(replace(state, stamp=0.0), np.empty((0, 10)))

    def _reseed(self) -> None:
        """Begin the streams of plant and laser afresh."""
        for stream in self._streams:
            reseed(stream, self._rng)

    def step(self, wheels: WheelSpeeds, blind: bool = False) -> SensorReadings:
        """Drive one control period of 0.1 s and return what was sensed in it.

        Args:
            wheels: Commanded wheel speeds.
            blind: Leave the scanner out, which costs most of the time; ``sweeps`` looks back.
        """
        rows = np.empty((TICKS_PER_STEP, 10))
        rows[:, 0] = (self._tick + 1 + np.arange(TICKS_PER_STEP)) / TICK_HZ
        rows[:, 1:] = self.vehicle.drive(wheels, TICKS_PER_STEP)
        self._tick += TICKS_PER_STEP
        self._track.extend(rows[:, 0], rows[:, 1:4], rows[:, 4:8])
        return self._sense(replace(self.vehicle.state, stamp=self._tick / TICK_HZ), rows, blind)

    def _sense(
        self, state: VehicleState, rows: NDArray[np.float64], blind: bool = False
    ) -> SensorReadings:
        """Sample the senses for the period that ends with the state.

        ``rows`` are stamp [s], pose and wheel speeds at each tick of the period, shape (k, 10).
        """
        sweeps = horizontal = None
        frames: tuple[PointCloud, ...] = ()
        begin = (self._tick - len(rows)) / TICK_HZ
        if self.lidar is not None and state.stamp > begin and not blind:
            sweeps = self.lidar.sweeps(begin, state.stamp, self._track)
            if self._many_beams:
                frames, sweeps = (cloud_of_sweeps(sweeps, self._tables),), None
        if self._scanner is not None and not blind:
            horizontal = self._scanner.ranges(state.pose)
        imu = encoders = field = fixes = None
        if self.proprioception is not None and len(rows):
            imu, encoders, field, fixes = self.proprioception.sample(rows)
        return SensorReadings(
            stamp=state.stamp,
            imu=imu,
            encoders=encoders,
            mag=field,
            gnss=fixes,
            sweeps=sweeps,
            frames=frames,
            horizontal=horizontal,
            truth=state,
            true_track=rows[:, :8],
        )

    def sweeps(self, begin: float, end: float, tilt: Rotation | None = None) -> Sweeps:
        """Return what the rotating laser saw in a past span [s], up to eight seconds back.

        Args:
            begin: Begin of the span [s].
            end: End of it [s].
            tilt: Rotation ``R_base_laser`` of a laser that is not mounted level.

        Raises:
            ValueError: If the robot has no rotating laser.
        """
        if self.lidar is None:
            raise ValueError("scanner: expected the rotating laser, got the horizontal one")
        track = self._track if tilt is None else self._track.turned(tilt)
        return self.lidar.sweeps(begin, end, track)

    def close(self) -> None:
        """Free the plant."""
        self.vehicle.close()
