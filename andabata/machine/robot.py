"""Parameters of the robot, and the URDF generated from them."""

import math
import tomllib
from importlib.resources import files
from typing import Self

from pydantic import BaseModel, ConfigDict, Field, model_validator


class RobotModel(BaseModel):
    """Four-wheel skid-steer robot; the defaults are Andabata (Sanchez et al. 2023, section 3.1).

    Attributes:
        name: Name of the robot.
        length: Length over all [m] (paper: 0.67).
        width: Width over all [m] (paper: 0.54).
        height: Height over all [m] (paper: 0.81).
        mass: Mass [kg] (paper: 41).
        wheel_radius: Wheel radius [m] (assumption).
        wheel_width: Wheel width [m] (assumption).
        wheel_mass: Mass of one wheel [kg] (assumption).
        track: Distance between the wheels of an axle [m] (assumption).
        wheelbase: Distance between the axles [m] (assumption).
        centre_of_mass: Height of the body's centre of mass above the ground [m] (assumption:
            batteries and motors lie low, the laser is light).
        clearance: Height of the body's floor above the ground [m] (assumption).
        max_traversable_vegetation: Height up to which the robot drives over plants [m]; higher ones
            are obstacles, in truth, labels and features (assumption).
        slip_factor: Effective track as a multiple of the geometric one, measured in the bullet
            plant at 0.3 m/s: 1.25 on flat ground, more on rough ground, where wheels lose contact;
            the default is a compromise (``docs/results/body.md`` has the numbers).
        creep: Largest speed at which a turning body creeps down a cross slope, per yaw rate [m]: a
            wheel that is dragged round has no lateral grip left. Measured in the bullet plant on
            slopes to 16 degrees, as are the next two.
        creep_slope: Sine of the roll at which the creep reaches three quarters of its largest.
        pivot: Distance uphill of the middle of the point that the body turns about, per unit of the
            pitch's sine [m].
        wheel_torque: Largest torque of a wheel [N m]; with 5 or less the robot cannot turn.
        lidar_height: Height of the optical centre above the ground [m] (inferred from the blind
            cone).
        speed: Constant longitudinal speed [m/s] (paper: 0.3).
        max_steering: Largest yaw rate command [rad/s] (paper: 0.5).
        dead_zone: Smallest yaw rate that is executed [rad/s] (paper: 0.15); smaller commands
            become zero.
        max_wheel_speed: Largest wheel speed [rad/s].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str = "andabata"
    length: float = Field(default=0.67, gt=0)
    width: float = Field(default=0.54, gt=0)
    height: float = Field(default=0.81, gt=0)
    mass: float = Field(default=41.0, gt=0)
    wheel_radius: float = Field(default=0.10, gt=0)
    wheel_width: float = Field(default=0.08, gt=0)
    wheel_mass: float = Field(default=1.5, gt=0)
    track: float = Field(default=0.46, gt=0)
    wheelbase: float = Field(default=0.40, gt=0)
    centre_of_mass: float = Field(default=0.25, gt=0)
    clearance: float = Field(default=0.09, gt=0)
    max_traversable_vegetation: float = Field(default=0.15, gt=0, le=1)
    slip_factor: float = Field(default=1.275, ge=1)
    creep: float = Field(default=0.18, ge=0)
    creep_slope: float = Field(default=0.09, gt=0)
    pivot: float = Field(default=0.31, ge=0)
    wheel_torque: float = Field(default=20.0, gt=0)
    lidar_height: float = Field(default=0.72, gt=0)
    speed: float = Field(default=0.3, gt=0)
    max_steering: float = Field(default=0.5, gt=0)
    dead_zone: float = Field(default=0.15, ge=0)
    max_wheel_speed: float = Field(default=12.0, gt=0)

    @model_validator(mode="after")
    def _check_sizes(self) -> Self:
        """Refuse a dead zone or wheels that do not fit the other parameters."""
        if self.dead_zone >= self.max_steering:
            raise ValueError(
                f"dead_zone: expected less than max_steering ({self.max_steering} rad/s), "
                f"got {self.dead_zone} rad/s"
            )
        if 4 * self.wheel_mass >= self.mass:
            raise ValueError(
                f"wheel_mass: expected four wheels lighter than the robot ({self.mass} kg), "
                f"got {self.wheel_mass} kg each"
            )
        return self

    @property
    def effective_track(self) -> float:
        """Distance between the sides' centres of rotation [m]."""
        return self.slip_factor * self.track

    @property
    def half_radius(self) -> float:
        """Radius of two circles, a quarter of the length before and behind, that cover it [m]."""
        return math.hypot(self.length / 4, self.width / 2)

    @classmethod
    def load(cls, name: str) -> Self:
        """Return a robot of the package by its name.

        Args:
            name: Name of a file in ``andabata/machine/robots``.

        Raises:
            ValueError: If there is no robot of that name.
        """
        folder = files("andabata.machine").joinpath("robots")
        known = sorted(entry.name.removesuffix(".toml") for entry in folder.iterdir())
        if name not in known:
            raise ValueError(f"robot: expected one of {', '.join(known)}, got {name!r}")
        return cls.model_validate(tomllib.loads(folder.joinpath(f"{name}.toml").read_text()))

    def to_urdf(self, spheres: bool = False) -> str:
        """Return the robot as URDF; the root is ``base_link``, at the height of the axles.

        Args:
            spheres: True to add a sphere to each wheel, as a link of its own that turns with it.
        """
        body_mass = self.mass - 4 * self.wheel_mass
        body_height = self.height - self.clearance
        middle = self.clearance + body_height / 2 - self.wheel_radius
        lever = self.centre_of_mass - self.wheel_radius
        # The body's mass centre lies low: inertia of a box half as high as the body.
        inertia = _box_inertia(body_mass, self.length, self.width - 0.1, body_height / 2)
        shell = self.track - self.wheel_width - 0.02
        links = [
            '<link name="base_link">',
            f'<inertial><origin xyz="0 0 {lever}"/><mass value="{body_mass}"/>{inertia}</inertial>',
            f'<collision><origin xyz="0 0 {middle}"/><geometry>'
            f'<box size="{self.length} {shell} {body_height}"/></geometry></collision>',
            # Above the wheels the body is as wide as the robot.
            f'<collision><origin xyz="0 0 {middle + self.wheel_radius}"/><geometry>'
            f'<box size="{self.length} {self.width} {body_height - 2 * self.wheel_radius}"/>'
            "</geometry></collision>",
            "</link>",
        ]
        for side, y in (("left", 1), ("right", -1)):
            for end, x in (("front", 1), ("rear", -1)):
                links.append(self._wheel(f"{end}_{side}", x, y))
                if spheres:
                    links.append(self._sphere(f"{end}_{side}"))
        return f'<robot name="{self.name}">{"".join(links)}</robot>'

    def _wheel(self, name: str, x: int, y: int) -> str:
        """Return a wheel and its joint as URDF; ``x`` and ``y`` are the signs of its position."""
        r, w, m = self.wheel_radius, self.wheel_width, self.wheel_mass
        across, along = m * (3 * r * r + w * w) / 12, m * r * r / 2
        cylinder = f'<cylinder radius="{r}" length="{w}"/>'
        shape = f'<origin rpy="1.5707963 0 0"/><geometry>{cylinder}</geometry>'
        return (
            f'<link name="{name}"><inertial><mass value="{m}"/><inertia ixx="{across}" '
            f'iyy="{along}" izz="{across}" ixy="0" ixz="0" iyz="0"/></inertial>'
            f"<collision>{shape}</collision></link>"
            f'<joint name="{name}_joint" type="continuous"><parent link="base_link"/>'
            f'<child link="{name}"/><axis xyz="0 1 0"/>'
            f'<origin xyz="{x * self.wheelbase / 2} {y * self.track / 2} 0"/></joint>'
        )

    def _sphere(self, wheel: str) -> str:
        """Return a sphere as large as a wheel and its fixed joint as URDF; it weighs nothing."""
        mass, radius = 1e-6, self.wheel_radius
        inertia = _box_inertia(mass, radius, radius, radius)
        return (
            f'<link name="{wheel}_sphere"><inertial><mass value="{mass}"/>{inertia}</inertial>'
            f'<collision><geometry><sphere radius="{radius}"/></geometry></collision></link>'
            f'<joint name="{wheel}_sphere_joint" type="fixed"><parent link="{wheel}"/>'
            f'<child link="{wheel}_sphere"/></joint>'
        )


def _box_inertia(mass: float, length: float, width: float, height: float) -> str:
    """Return the inertia of a box [kg, m] about its centre as URDF."""
    xx = mass * (width**2 + height**2) / 12
    yy = mass * (length**2 + height**2) / 12
    zz = mass * (length**2 + width**2) / 12
    return f'<inertia ixx="{xx}" iyy="{yy}" izz="{zz}" ixy="0" ixz="0" iyz="0"/>'
