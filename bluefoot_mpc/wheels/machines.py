"""Walking machines that the second document shows, with the figures that it gives; SI units."""

from __future__ import annotations

from dataclasses import dataclass

from bluefoot_mpc.wheels.pendulum import GRAVITY


@dataclass(frozen=True, kw_only=True, slots=True)
class WalkingMachine:
    """A machine and its data sheet; None where none is given."""

    name: str
    legs: int
    joints_per_leg: int
    arms: int = 0
    joints_per_arm: int = 0
    speed: float | None = None  # m/s, at most
    mass: float | None = None  # kg
    height: float | None = None  # m
    length: float | None = None  # m
    power: float | None = None  # W
    autonomy: float | None = None  # s

    @property
    def joints(self) -> int:
        """Joints of legs and arms together."""
        return self.legs * self.joints_per_leg + self.arms * self.joints_per_arm

    @property
    def cost_of_transport(self) -> float | None:
        """Power per weight and top speed, without unit; None where a figure is missing."""
        if self.power is None or self.mass is None or self.speed is None:
            return None
        return self.power / (self.mass * GRAVITY * self.speed)


MACHINES: dict[str, WalkingMachine] = {
    machine.name: machine
    for machine in (
        WalkingMachine(
            name="Honda P2", legs=2, joints_per_leg=6, arms=2, joints_per_arm=7, speed=2.0 / 3.6,
            mass=210.0, height=1.82, autonomy=15.0 * 60.0,
        ),
        WalkingMachine(
            name="Ohio State hexapod", legs=6, joints_per_leg=3, speed=2.3, mass=3200.0,
            height=3.0, length=5.2,
        ),
        WalkingMachine(
            name="Lauron II", legs=6, joints_per_leg=3, speed=0.5, mass=6.0, height=0.3,
            length=0.7, power=10.0,
        ),
    )
}  # fmt: skip
