"""The robot's parameters, read from one TOML file and checked."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.geometry import rotation_from_rpy
from bluefoot_mpc.model.resources import model_file
from bluefoot_mpc.settings import (
    build,
    read_toml,
    require_finite,
    require_nonnegative,
    require_positive,
    require_range,
)
from bluefoot_mpc.types import LEG_JOINTS, FloatArray

GRAVITY = 9.80665
"""m/s², the one value that Pinocchio, MuJoCo and every law use."""

Range = tuple[float, float]


@dataclass(frozen=True, kw_only=True, slots=True)
class JointRanges:
    """Lowest and highest angle of each joint of a leg, degrees."""

    hip_yaw: Range
    hip_pitch: Range
    knee: Range
    ankle: Range

    def __post_init__(self) -> None:
        for name in LEG_JOINTS:
            low, high = getattr(self, name)
            if not -180.0 <= low < high <= 180.0:
                raise ConfigurationError(
                    f"{name} = [{low:g}, {high:g}] must be rising and inside ±180 degrees"
                )

    def radians(self) -> tuple[FloatArray, FloatArray]:
        """(4,) lower and (4,) upper limits of one leg, rad."""
        table = np.radians([self.hip_yaw, self.hip_pitch, self.knee, self.ankle])
        return table[:, 0].copy(), table[:, 1].copy()


@dataclass(frozen=True, kw_only=True, slots=True)
class LegParameters:
    """Geometry of the legs, equal for all four but for their azimuth."""

    link_lengths: tuple[float, float, float, float]  # m
    hip_offset: float  # m, trunk centre to hip_yaw axis
    hip_azimuth_deg: tuple[float, float, float, float]  # FL, FR, RL, RR
    foot_radius: float  # m
    limits_deg: JointRanges  # imposed by software
    physical_limits_deg: JointRanges  # where the mechanism stops

    def __post_init__(self) -> None:
        require_positive(hip_offset=self.hip_offset, foot_radius=self.foot_radius)
        require_positive(**{f"link_lengths[{i}]": length for i, length in enumerate(self.link_lengths)})
        require_finite(hip_azimuth_deg=self.hip_azimuth_deg)
        if self.foot_radius >= self.link_lengths[3]:
            raise ConfigurationError(
                f"foot_radius = {self.foot_radius:g} must be less than the last link, "
                f"link_lengths[3] = {self.link_lengths[3]:g}"
            )
        for name in LEG_JOINTS:
            (low, high), (lowest, highest) = (
                getattr(limits, name) for limits in (self.limits_deg, self.physical_limits_deg)
            )
            if low < lowest or high > highest:
                raise ConfigurationError(
                    f"limits_deg.{name} = [{low:g}, {high:g}] must lie inside "
                    f"physical_limits_deg.{name} = [{lowest:g}, {highest:g}]"
                )


@dataclass(frozen=True, kw_only=True, slots=True)
class StanceParameters:
    """Default stance: where the feet stand under a level trunk."""

    foot_x: float  # m
    foot_y: float  # m
    trunk_height: float  # m, trunk origin above the foot points
    ankle_direction_deg: float  # direction of the last link in the leg's plane

    def __post_init__(self) -> None:
        require_positive(foot_x=self.foot_x, foot_y=self.foot_y, trunk_height=self.trunk_height)
        require_range(-180.0, 180.0, ankle_direction_deg=self.ankle_direction_deg)

    @property
    def foot_position(self) -> FloatArray:
        """(4, 3) m, feet on the ground under the trunk's centre, FL, FR, RL, RR."""
        x, y = self.foot_x, self.foot_y
        return np.array([[x, y, 0.0], [x, -y, 0.0], [-x, y, 0.0], [-x, -y, 0.0]])


@dataclass(frozen=True, kw_only=True, slots=True)
class ServoParameters:
    """A position-controlled servo as its data sheet and identification give it."""

    stall_torque: float  # N·m at nominal voltage
    no_load_speed: float  # rad/s at nominal voltage
    nominal_voltage: float  # V
    steps: int  # counts over the range
    range_deg: float
    compliance_slope: float  # counts of error for full duty
    compliance_margin: float  # counts without reaction
    punch: float  # of 1023, least duty outside the margin
    armature: float  # kg·m²
    coulomb_friction: float  # N·m
    viscous_friction: float  # N·m·s/rad
    load_friction: float  # share of transmitted torque
    backlash_deg: float
    stall_current: float  # A
    thermal_resistance: float  # K/W
    thermal_time_constant: float  # s
    ambient: float  # °C

    def __post_init__(self) -> None:
        require_positive(
            stall_torque=self.stall_torque, no_load_speed=self.no_load_speed,
            nominal_voltage=self.nominal_voltage, steps=self.steps, range_deg=self.range_deg,
            compliance_slope=self.compliance_slope, armature=self.armature,
            stall_current=self.stall_current, thermal_time_constant=self.thermal_time_constant,
        )  # fmt: skip
        require_nonnegative(
            compliance_margin=self.compliance_margin, punch=self.punch,
            coulomb_friction=self.coulomb_friction, viscous_friction=self.viscous_friction,
            load_friction=self.load_friction, backlash_deg=self.backlash_deg,
            thermal_resistance=self.thermal_resistance,
        )  # fmt: skip
        require_range(2, 65536, steps=self.steps)
        require_range(0.0, 360.0, range_deg=self.range_deg)
        require_range(0.0, 1.0, load_friction=self.load_friction)

    @property
    def step_angle(self) -> float:
        """Angle of one count, rad."""
        return math.radians(self.range_deg) / (self.steps - 1)

    @property
    def stiffness(self) -> float:
        """Stiffness, N·m/rad at nominal voltage: full duty over the compliance slope."""
        return self.stall_torque / (self.compliance_slope * self.step_angle)

    @property
    def back_emf(self) -> float:
        """Back-EMF, N·m·s/rad: torque lost per speed, stall torque over no-load speed."""
        return self.stall_torque / self.no_load_speed


@dataclass(frozen=True, kw_only=True, slots=True)
class BatteryParameters:
    """The servos' pack."""

    resistance: float  # Ω
    full_voltage: float  # V
    empty_voltage: float  # V

    def __post_init__(self) -> None:
        require_nonnegative(resistance=self.resistance)
        require_positive(full_voltage=self.full_voltage, empty_voltage=self.empty_voltage)
        if self.empty_voltage >= self.full_voltage:
            raise ConfigurationError(
                f"empty_voltage = {self.empty_voltage:g} must be less than "
                f"full_voltage = {self.full_voltage:g}"
            )


@dataclass(frozen=True, kw_only=True, slots=True)
class SensorMounts:
    """Where the sensors are, in the base frame; camera and LIDAR look along x, the latter if not turned."""

    imu: tuple[float, float, float]  # m
    lidar: tuple[float, float, float]  # m
    camera: tuple[float, float, float]  # m
    camera_view_deg: float = 63.0  # degrees, from the left edge of a picture to its right edge
    lidar_rpy_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)  # degrees, roll, pitch, yaw of its scan plane

    def __post_init__(self) -> None:
        require_range(10.0, 150.0, camera_view_deg=self.camera_view_deg)
        for name, angle in zip(("roll", "pitch", "yaw"), self.lidar_rpy_deg, strict=True):
            require_range(-30.0, 30.0, **{f"lidar_rpy_deg ({name})": angle})

    @property
    def lidar_rotation(self) -> FloatArray:
        """(3, 3) rotation from the LIDAR's frame (scan plane x-y, x forward) to the base frame."""
        return rotation_from_rpy(np.radians(self.lidar_rpy_deg))

    def focal_length(self, width: int) -> float:
        """Focal length in pixels of pictures that are `width` pixels wide."""
        return 0.5 * width / math.tan(0.5 * math.radians(self.camera_view_deg))


@dataclass(frozen=True, kw_only=True, slots=True)
class PowerLoad:
    """One consumer of the power table."""

    name: str
    net: int
    voltage: float  # V
    current: float  # A

    def __post_init__(self) -> None:
        require_positive(voltage=self.voltage)
        require_nonnegative(current=self.current)


@dataclass(frozen=True, kw_only=True, slots=True)
class PowerPack:
    """One battery of the power table."""

    net: int
    voltage: float  # V
    capacity_ah: float

    def __post_init__(self) -> None:
        require_positive(voltage=self.voltage, capacity_ah=self.capacity_ah)


@dataclass(frozen=True, kw_only=True, slots=True)
class PowerParameters:
    """The power table of the robot."""

    losses: float  # W
    worst_case: float  # W
    loads: tuple[PowerLoad, ...]
    packs: tuple[PowerPack, ...]

    def __post_init__(self) -> None:
        require_nonnegative(losses=self.losses)
        require_positive(worst_case=self.worst_case)


@dataclass(frozen=True, kw_only=True, slots=True)
class Part:
    """A rigid piece of the mass budget, and what it looks like.

    Leg bodies are ``link1`` to ``link4``, their frames at the joint with x along
    the link; each leg gets its own copy. ``size`` is x, y, z of a box, radius
    and length of a cylinder (along z, or x for ``cylinder_x``), or a radius.
    """

    name: str
    body: Literal["trunk", "link1", "link2", "link3", "link4"]
    mass: float  # kg
    shape: Literal["box", "cylinder", "cylinder_x", "sphere"]
    size: tuple[float, ...]  # m
    position: tuple[float, float, float]  # m, centre in the body's frame

    def __post_init__(self) -> None:
        if not self.name:
            raise ConfigurationError("name must not be empty")
        require_positive(**{f"mass of '{self.name}'": self.mass})
        count = {"box": 3, "cylinder": 2, "cylinder_x": 2, "sphere": 1}[self.shape]
        if len(self.size) != count:
            raise ConfigurationError(
                f"size of '{self.name}': a {self.shape} takes {count} sizes, not {len(self.size)}"
            )
        require_positive(**{f"size[{i}] of '{self.name}'": length for i, length in enumerate(self.size)})
        # Grams or millimetres by mistake would make a robot that no engine can simulate.
        require_range(1e-5, 100.0, **{f"mass (kg) of '{self.name}'": self.mass})
        require_range(1e-4, 10.0, **{f"size[{i}] (m) of '{self.name}'": x for i, x in enumerate(self.size)})
        require_range(
            -10.0, 10.0, **{f"position[{i}] (m) of '{self.name}'": x for i, x in enumerate(self.position)}
        )


@dataclass(frozen=True, kw_only=True, slots=True)
class RobotParameters:
    """Everything that describes one robot."""

    name: str
    legs: LegParameters
    stance: StanceParameters
    servo: ServoParameters
    battery: BatteryParameters
    sensors: SensorMounts
    power: PowerParameters
    parts: tuple[Part, ...]

    def __post_init__(self) -> None:
        for body in ("trunk", "link1", "link2", "link3", "link4"):
            if not any(part.body == body for part in self.parts):
                raise ConfigurationError(f"no [[parts]] entry gives the body '{body}' a mass")
        names = [part.name for part in self.parts]
        for name in names:
            if names.count(name) > 1:
                raise ConfigurationError(f"{names.count(name)} [[parts]] entries have the name '{name}'")

    @property
    def total_mass(self) -> float:
        """kg, the trunk and four legs."""
        return sum(part.mass * (1 if part.body == "trunk" else 4) for part in self.parts)


def load_parameters(path: str | Path | None = None) -> RobotParameters:
    """Read a robot's parameter file.

    Args:
        path: a TOML file, or the name of one that ships (``"bluefoot"``);
            ``None`` is BlueFoot itself.

    Raises:
        ConfigurationError: the file is missing, or a value is missing or impossible.
    """
    file = model_file("bluefoot" if path is None else path)
    table = read_toml(file)
    try:
        return build(RobotParameters, table)
    except ConfigurationError as error:
        raise ConfigurationError(f"{file.name}: {error}") from error
