"""Configuration of the simulated robot and its world."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError
from bluefoot_mpc.settings import require_finite, require_nonnegative, require_positive, require_range
from bluefoot_mpc.sim.leader_config import LeaderConfig
from bluefoot_mpc.sim.sight_config import CameraConfig, LidarConfig

OPEN_WORLDS = ("flat", "rough", "slope", "steps")
"""Names of the worlds that are nothing but ground."""

PLANNED_WORLDS = ("room", "corridors", "chairs", "maze", "dead_ends", "hidden", "arena")
"""Names of the worlds in which things stand; the seed decides where."""

TERRAIN_WORLDS = ("rubble", "random_steps", "ramp", "kerb", "gap", "stones")
"""Names of the worlds of rough ground, flat where the robot starts; the seed decides how it lies."""

TERRAIN_HEIGHTS = {"rubble": 0.020, "random_steps": 0.020, "ramp": 0.070, "kerb": 0.025, "stones": 0.006}
"""m, highest over lowest of the ground ahead where none is given; a gap has its width instead."""

GREATEST_TERRAIN = 0.10
"""m; the robot's trunk is 0.11 m above the ground, so that nothing higher is ground to it."""

GREATEST_STONES = 0.05
"""m; the floor between the stones is 0.08 m down."""

WORLDS = (*OPEN_WORLDS, *PLANNED_WORLDS, *TERRAIN_WORLDS)
"""Names of the worlds that ship."""

DEFAULT_SLOPE_DEG = 5.0
"""Degrees, the climb of the world ``slope`` where none is given."""


@dataclass(frozen=True, kw_only=True, slots=True)
class WorldConfig:
    """The ground and what the robot carries over it."""

    name: str = "flat"  # one of WORLDS, or the path of a plan (.toml) or of an MJCF file
    layout_seed: int = -1  # of where things stand; -1 takes the run's seed
    friction: float = 0.8  # Coulomb, feet on the ground
    slope_deg: float = 0.0  # degrees, positive climbs along +x; tilts the whole world
    step_height: float = 0.01  # m, each step of the world "steps"
    step_depth: float = 0.25  # m along x
    step_count: int = 4  # steps up, then as many down
    step_start: float = 0.30  # m, first riser in front of the robot
    rough_height: float = 0.010  # m, highest point over lowest of the world "rough"
    rough_wavelength: float = 0.15  # m, size of the bumps
    rough_seed: int = 0  # shape of the terrain
    terrain_height: float = 0.0  # m, highest over lowest of one of TERRAIN_WORLDS; 0 takes TERRAIN_HEIGHTS
    ramp_deg: float = 10.0  # degrees, up and down, of the world "ramp"
    gap: float = 0.06  # m, width of the gap of "gap"; between "stones" on average
    stone: float = 0.12  # m, side of one of the "stones"
    payload: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)  # kg; x, y, z m on the trunk

    def __post_init__(self) -> None:
        if self.name not in WORLDS and not Path(self.name).is_file():
            if Path(self.name).suffix or "/" in self.name:
                raise ConfigurationError(
                    f"no world file '{self.name}': give a plan (.toml), an MJCF file, or one of:"
                    f" {', '.join(WORLDS)}"
                )
            raise UnknownNameError("world", self.name, WORLDS)
        if self.layout_seed < -1:
            raise ConfigurationError(
                f"layout_seed = {self.layout_seed} must not be negative, but -1, which takes the run's seed"
            )
        require_nonnegative(friction=self.friction, payload=self.payload[0], rough_seed=self.rough_seed)
        require_range(-45.0, 45.0, slope_deg=self.slope_deg)
        require_positive(
            step_height=self.step_height, step_depth=self.step_depth, step_count=self.step_count,
            rough_height=self.rough_height, rough_wavelength=self.rough_wavelength,
        )  # fmt: skip
        require_finite(payload=self.payload, step_start=self.step_start)
        if self.is_planned and self.slope_deg != 0.0:
            raise ConfigurationError(
                f"the world '{self.name}' is level: leave slope_deg = {self.slope_deg:g} out,"
                f" or take one of: {', '.join(OPEN_WORLDS)}"
            )
        self._require_terrain()

    def _require_terrain(self) -> None:
        """Refuse rough ground that cannot be."""
        greatest = GREATEST_STONES if self.name == "stones" else GREATEST_TERRAIN
        require_range(0.0, greatest, terrain_height=self.terrain_height)
        require_range(3.0, 30.0, ramp_deg=self.ramp_deg)
        require_range(0.01, 0.30, gap=self.gap)
        require_range(0.03, 0.50, stone=self.stone)

    def require_effect(self) -> None:
        """Refuse figures of rough ground that the world has none of; options may still change its name.

        Raises:
            ConfigurationError: one of them has no effect.
        """
        given = (
            ("terrain_height", 0.0, tuple(TERRAIN_HEIGHTS)),
            ("ramp_deg", 10.0, ("ramp",)),
            ("gap", 0.06, ("gap", "stones")),
            ("stone", 0.12, ("stones",)),
        )
        for name, default, worlds in given:
            value = getattr(self, name)
            if value != default and self.name not in worlds:
                raise ConfigurationError(
                    f"sim.world.{name} = {value:g} has no effect in the world '{self.name}': leave it out,"
                    f" or take one of: {', '.join(worlds)}"
                )

    @property
    def is_planned(self) -> bool:
        """True where a plan says what stands on the floor: from a seed, or from a file."""
        return self.name in (*PLANNED_WORLDS, *TERRAIN_WORLDS) or self.name.endswith(".toml")

    @property
    def relief(self) -> float:
        """Highest over lowest of the ground of one of `TERRAIN_WORLDS`, m; zero without."""
        return self.terrain_height or TERRAIN_HEIGHTS.get(self.name, 0.0)

    @property
    def slope(self) -> float:
        """Climb of the world along +x, rad."""
        if self.name == "slope" and self.slope_deg == 0.0:
            return math.radians(DEFAULT_SLOPE_DEG)
        return math.radians(self.slope_deg)


@dataclass(frozen=True, kw_only=True, slots=True)
class PushConfig:
    """A constant force on the trunk's origin for a short while."""

    time: float  # s after the reset
    impulse: float  # N·s
    direction_deg: float = 0.0  # where it pushes to: 0 along world x, 90 along y
    duration: float = 0.1  # s

    def __post_init__(self) -> None:
        require_nonnegative(time=self.time, impulse=self.impulse)
        require_positive(duration=self.duration)
        require_finite(direction_deg=self.direction_deg)

    @property
    def force(self) -> tuple[float, float, float]:
        """N, world axes."""
        angle, size = math.radians(self.direction_deg), self.impulse / self.duration
        return (size * math.cos(angle), size * math.sin(angle), 0.0)


@dataclass(frozen=True, kw_only=True, slots=True)
class SensorConfig:
    """Errors of the sensors: assumptions, since none of the robot's own are published."""

    gyro_noise: float = 0.01  # rad/s per sample, white
    gyro_bias: float = 0.02  # rad/s, uniform in ± this, per axis and run
    gyro_drift: float = 0.001  # rad/s, standard deviation of the random walk after a minute
    accel_noise: float = 0.1  # m/s² per sample, white
    accel_bias: float = 0.03  # m/s², uniform in ± this, per axis and run
    magnetometer_noise: float = 0.01  # of the field, white
    magnetometer_bias: float = 0.03  # of the field, hard iron, uniform in ± this
    magnetic_inclination_deg: float = 65.0  # degrees that the field dips; world x is magnetic north
    imu_period: float = 0.005  # s, gyro and accelerometer
    magnetometer_divider: int = 4  # inertial samples per magnetometer sample
    switch_delay: float = 0.010  # s
    switch_threshold: float = 0.3  # N
    switch_chatter: float = 0.01  # share of edges that fall back once
    switch_chatter_time: float = 0.010  # s that such an edge falls back for
    speed_noise: float = 0.1  # rad/s, reported joint speed
    load_step: float = 0.02  # of stall torque, reported load
    load_noise: float = 0.02  # of stall torque

    def __post_init__(self) -> None:
        require_nonnegative(
            gyro_noise=self.gyro_noise, gyro_bias=self.gyro_bias, gyro_drift=self.gyro_drift,
            accel_noise=self.accel_noise, accel_bias=self.accel_bias,
            magnetometer_noise=self.magnetometer_noise, magnetometer_bias=self.magnetometer_bias,
            switch_delay=self.switch_delay, switch_threshold=self.switch_threshold,
            switch_chatter_time=self.switch_chatter_time, speed_noise=self.speed_noise,
            load_noise=self.load_noise,
        )  # fmt: skip
        require_positive(
            imu_period=self.imu_period, magnetometer_divider=self.magnetometer_divider,
            load_step=self.load_step,
        )  # fmt: skip
        require_range(0.0, 1.0, switch_chatter=self.switch_chatter)
        require_range(-90.0, 90.0, magnetic_inclination_deg=self.magnetic_inclination_deg)


@dataclass(frozen=True, kw_only=True, slots=True)
class RandomizationConfig:
    """What differs from the nominal robot, drawn once from the seed."""

    preset: Literal["none", "standard"] = "none"  # none draws nothing; standard draws all below
    friction: tuple[float, float] = (0.5, 1.0)  # foot on ground
    mass: float = 0.10  # ± share, one factor for all bodies
    com: float = 0.005  # ± m, centre of mass of the trunk along each axis
    servo_gain: float = 0.20  # ± share of the compliance slope's gain, each servo its own
    voltage: tuple[float, float] = (10.8, 12.4)  # V of the open pack
    latency: tuple[float, float] = (0.010, 0.040)  # s from command to servo
    servo_friction: float = 0.0  # ± share of Coulomb and load friction, each servo its own

    def __post_init__(self) -> None:
        for name in ("friction", "voltage", "latency"):
            low, high = getattr(self, name)
            if not 0.0 <= low <= high < math.inf:
                raise ConfigurationError(f"{name} = [{low!r}, {high!r}] must be rising and not negative")
        require_range(
            0.0, 0.95, mass=self.mass, servo_gain=self.servo_gain, servo_friction=self.servo_friction
        )
        require_range(0.0, 0.1, com=self.com)


@dataclass(frozen=True, kw_only=True, slots=True)
class SimConfig:
    """The simulated robot: rates, servos, battery, sensors, world and disturbances."""

    command_period: float = 0.020  # s between commands
    physics_period: float = 0.001  # s
    latency: float = 0.020  # s from command to servo, bus included; rounded to the physics period
    voltage: float = 12.0  # V of the open pack
    standby_current: float = 0.05  # A of one servo whose motor rests
    backlash_deg: float | None = None  # degrees in all; None takes the parameter file's
    load_friction_speed: float = 0.5  # rad/s above which load-dependent friction fades
    settle_time: float = 0.5  # s of standing before the run starts
    visuals: bool = False  # keep the shapes that are only to look at, for pictures from MuJoCo
    sensors: SensorConfig = field(default_factory=SensorConfig)
    lidar: LidarConfig = field(default_factory=LidarConfig)
    camera: CameraConfig = field(default_factory=CameraConfig)
    world: WorldConfig = field(default_factory=WorldConfig)
    leader: LeaderConfig = field(default_factory=LeaderConfig)
    randomization: RandomizationConfig = field(default_factory=RandomizationConfig)
    pushes: tuple[PushConfig, ...] = ()

    def __post_init__(self) -> None:
        require_positive(voltage=self.voltage, load_friction_speed=self.load_friction_speed)
        require_nonnegative(standby_current=self.standby_current)
        require_range(1e-4, 2e-3, physics_period=self.physics_period)
        require_range(1e-3, 0.2, command_period=self.command_period)
        require_range(0.0, 60.0, settle_time=self.settle_time)
        require_range(0.0, 1.0, latency=self.latency)
        if self.backlash_deg is not None:
            require_range(0.0, 5.0, backlash_deg=self.backlash_deg)
        uneven = ("rough", "steps", *TERRAIN_WORLDS)
        if self.leader.kind and (self.world.name in uneven or self.world.slope != 0.0):
            raise ConfigurationError(
                f"a leader drives on level floor: world '{self.world.name}' is none; take flat or arena"
            )
        for name, period in (
            ("command_period", self.command_period),
            ("sensors.imu_period", self.sensors.imu_period),
        ):
            steps = period / self.physics_period
            if steps < 0.5 or abs(steps - round(steps)) > 1e-6:
                raise ConfigurationError(
                    f"{name} = {period:g} s must be a whole number of physics steps"
                    f" of {self.physics_period:g} s"
                )
