"""Random streams of a run, and what its seed makes of the nominal robot."""

from __future__ import annotations

import zlib
from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.sim.config import SimConfig
from bluefoot_mpc.types import N_JOINTS, FloatArray


def stream(seed: int, name: str) -> np.random.Generator:
    """A generator of its own for each purpose: adding one changes no other."""
    return np.random.default_rng(np.random.SeedSequence([seed, zlib.crc32(name.encode())]))


@dataclass(frozen=True, slots=True)
class Draw:
    """What holds in one run.

    Attributes:
        friction: Coulomb coefficient, foot on ground.
        mass_factor: on every body's mass and inertia.
        com_offset: (3,) m, shift of the trunk's centre of mass.
        servo_gain: (16,) factors on the servos' compliance slopes.
        servo_friction: (16,) factors on Coulomb and load friction.
        voltage: V of the open pack.
        latency: s from command to servo.
    """

    friction: float
    mass_factor: float
    com_offset: FloatArray
    servo_gain: FloatArray
    servo_friction: FloatArray
    voltage: float
    latency: float

    def as_dict(self) -> dict[str, float | list[float]]:
        """Plain numbers for a log."""
        return {
            name: value.tolist() if isinstance(value := getattr(self, name), np.ndarray) else value
            for name in self.__dataclass_fields__
        }


def draw(config: SimConfig, seed: int) -> Draw:
    """Draw a run's robot and ground from its seed; the nominal ones without randomisation."""
    spread = config.randomization
    if spread.preset == "none":
        ones = np.ones(N_JOINTS)
        return Draw(
            config.world.friction, 1.0, np.zeros(3), ones, ones.copy(), config.voltage, config.latency
        )

    def within(name: str, low: float, high: float, size: int | None = None) -> FloatArray:
        return np.asarray(stream(seed, f"randomization.{name}").uniform(low, high, size))

    return Draw(
        friction=float(within("friction", *spread.friction)),
        mass_factor=float(within("mass", 1.0 - spread.mass, 1.0 + spread.mass)),
        com_offset=within("com", -spread.com, spread.com, 3),
        servo_gain=within("gain", 1.0 - spread.servo_gain, 1.0 + spread.servo_gain, N_JOINTS),
        servo_friction=within(
            "servo friction", 1.0 - spread.servo_friction, 1.0 + spread.servo_friction, N_JOINTS
        ),
        voltage=float(within("voltage", *spread.voltage)),
        latency=float(within("latency", *spread.latency)),
    )
