"""Equations of motion of what falls over: a body on two wheels, and two pendulums on a cart.

Angles are from the upright, positive towards +x (nose-down). Both sets come from
Lagrange's equations without small angles; the linear models are derivatives at rest.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.settings import require_nonnegative, require_positive
from bluefoot_mpc.types import FloatArray

GRAVITY = 9.81
"""m/s²."""


@dataclass(frozen=True, kw_only=True, slots=True)
class WheeledPendulum:
    """A body that stands on one axle with two wheels, which motors turn against the body.

    State: (axle's position m, its speed m/s, tilt rad, tilt rate rad/s). Input: torque of both
    motors together (N·m), positive turns the wheels forward and the body back.
    """

    body_mass: float = 0.8  # kg
    body_height: float = 0.10  # m, centre of mass of the body above the axle
    body_inertia: float = 0.004  # kg·m², about its centre of mass, pitch
    wheel_mass: float = 0.12  # kg, both wheels
    wheel_inertia: float = 1e-4  # kg·m², both wheels about the axle, with what turns in the motors
    wheel_radius: float = 0.04  # m
    friction: float = 0.002  # N·m·s/rad, of both wheels against the body

    def __post_init__(self) -> None:
        require_positive(
            body_mass=self.body_mass, body_height=self.body_height, wheel_radius=self.wheel_radius
        )
        require_nonnegative(
            body_inertia=self.body_inertia, wheel_mass=self.wheel_mass, wheel_inertia=self.wheel_inertia,
            friction=self.friction,
        )  # fmt: skip

    @property
    def rolling_mass(self) -> float:
        """Mass that a push along the floor has to move, wheels' rotation included (kg)."""
        return self.body_mass + self.wheel_mass + self.wheel_inertia / self.wheel_radius**2

    @property
    def tilting_inertia(self) -> float:
        """Inertia of the body about the axle (kg·m²)."""
        return self.body_inertia + self.body_mass * self.body_height**2

    def accelerations(
        self, speed: float, tilt: float, tilt_rate: float, torque: float
    ) -> tuple[float, float]:
        """Acceleration of the axle (m/s²) and of the tilt (rad/s²) for a motor torque (N·m)."""
        moment, s, c = self.body_mass * self.body_height, math.sin(tilt), math.cos(tilt)
        drive = torque - self.friction * (speed / self.wheel_radius - tilt_rate)
        push = drive / self.wheel_radius + moment * s * tilt_rate**2
        turn = moment * GRAVITY * s - drive
        coupling = moment * c
        determinant = self.rolling_mass * self.tilting_inertia - coupling**2
        return (
            (self.tilting_inertia * push - coupling * turn) / determinant,
            (self.rolling_mass * turn - coupling * push) / determinant,
        )

    def derivative(self, state: FloatArray, torque: float) -> FloatArray:
        """(4,) rate of change of the (4,) state."""
        speed, tilt, rate = (float(value) for value in state[1:])
        push, turn = self.accelerations(speed, tilt, rate, torque)
        return np.array([speed, push, rate, turn])

    def advanced(self, state: FloatArray, torque: float, dt: float) -> FloatArray:
        """(4,) state after `dt` (s) with the torque held (one step of Runge and Kutta's order 4)."""
        x, v, tilt, rate = state.tolist()  # plain floats: three times faster than small arrays
        half = 0.5 * dt
        a1, b1 = self.accelerations(v, tilt, rate, torque)
        v2, rate2 = v + half * a1, rate + half * b1
        a2, b2 = self.accelerations(v2, tilt + half * rate, rate2, torque)
        v3, rate3 = v + half * a2, rate + half * b2
        a3, b3 = self.accelerations(v3, tilt + half * rate2, rate3, torque)
        v4, rate4 = v + dt * a3, rate + dt * b3
        a4, b4 = self.accelerations(v4, tilt + dt * rate3, rate4, torque)
        sixth = dt / 6.0
        return np.array(
            [
                x + sixth * (v + 2.0 * (v2 + v3) + v4),
                v + sixth * (a1 + 2.0 * (a2 + a3) + a4),
                tilt + sixth * (rate + 2.0 * (rate2 + rate3) + rate4),
                rate + sixth * (b1 + 2.0 * (b2 + b3) + b4),
            ]
        )

    def linear(self) -> tuple[FloatArray, FloatArray]:
        """(4, 4) and (4, 1) matrices of the linear model at rest, upright."""
        moment, r = self.body_mass * self.body_height, self.wheel_radius
        inverse = np.linalg.inv([[self.rolling_mass, moment], [moment, self.tilting_inertia]])
        effort = inverse @ [1.0 / r, -1.0]  # of one unit of torque on both accelerations
        a = np.zeros((4, 4))
        a[0, 1] = a[2, 3] = 1.0
        a[[1, 3], 1] = -effort * self.friction / r
        a[[1, 3], 2] = inverse @ [0.0, moment * GRAVITY]
        a[[1, 3], 3] = effort * self.friction
        b = np.zeros((4, 1))
        b[[1, 3], 0] = effort
        return a, b

    def energy(self, state: FloatArray) -> float:
        """Kinetic and potential energy, zero at rest at the height of the axle (J)."""
        _, speed, tilt, rate = state.tolist()
        moment = self.body_mass * self.body_height
        kinetic = 0.5 * self.rolling_mass * speed**2 + 0.5 * self.tilting_inertia * rate**2
        return float(kinetic + moment * math.cos(tilt) * (speed * rate + GRAVITY))


@dataclass(frozen=True, kw_only=True, slots=True)
class DoublePendulum:
    """Two rods on a cart, one on the other: a walker's legs and trunk in the simplest form.

    State: (cart m, first rod rad, second rod rad, and their rates), both angles from the upright.
    Input: force on the cart (N).
    """

    cart_mass: float = 1.0  # kg
    masses: tuple[float, float] = (0.5, 0.3)  # kg, lower and upper rod
    lengths: tuple[float, float] = (0.4, 0.3)  # m
    centres: tuple[float, float] = (0.2, 0.15)  # m, centre of mass from the rod's lower end
    inertias: tuple[float, float] = (0.0067, 0.0023)  # kg·m², about the centre of mass

    def __post_init__(self) -> None:
        require_positive(cart_mass=self.cart_mass)
        for name in ("masses", "lengths", "centres"):
            for value in getattr(self, name):
                require_positive(**{name: value})
        for value in self.inertias:
            require_nonnegative(inertias=value)

    def mass_matrix(self, angles: FloatArray) -> FloatArray:
        """(3, 3) inertia for (2,) angles of the rods."""
        (m1, m2), (c1, c2), length = self.masses, self.centres, self.lengths[0]
        first, second, across = self._moments()
        cross = across * math.cos(angles[0] - angles[1])
        one, two = first * math.cos(angles[0]), second * math.cos(angles[1])
        return np.array(
            [
                [self.cart_mass + m1 + m2, one, two],
                [one, self.inertias[0] + m1 * c1**2 + m2 * length**2, cross],
                [two, cross, self.inertias[1] + m2 * c2**2],
            ]
        )

    def derivative(self, state: FloatArray, force: float) -> FloatArray:
        """(6,) rate of change of the (6,) state."""
        angles, rates = state[1:3], state[4:6]
        first, second, across = self._moments()
        s = np.sin(angles)
        swing = across * math.sin(angles[0] - angles[1])
        right = np.array(
            [
                force + first * s[0] * rates[0] ** 2 + second * s[1] * rates[1] ** 2,
                first * GRAVITY * s[0] - swing * rates[1] ** 2,
                second * GRAVITY * s[1] + swing * rates[0] ** 2,
            ]
        )
        return np.concatenate([state[3:], np.linalg.solve(self.mass_matrix(angles), right)])

    def linear(self) -> tuple[FloatArray, FloatArray]:
        """(6, 6) and (6, 1) matrices of the linear model at rest, both rods upright."""
        first, second, _ = self._moments()
        mobility = np.linalg.inv(self.mass_matrix(np.zeros(2)))
        a, b = np.zeros((6, 6)), np.zeros((6, 1))
        a[:3, 3:] = np.eye(3)
        a[3:, :3] = mobility @ np.diag([0.0, first * GRAVITY, second * GRAVITY])
        b[3:, 0] = mobility[:, 0]
        return a, b

    def energy(self, state: FloatArray) -> float:
        """Kinetic and potential energy, zero at rest at the height of the cart (J)."""
        first, second, _ = self._moments()
        height = first * math.cos(state[1]) + second * math.cos(state[2])
        return float(0.5 * state[3:] @ self.mass_matrix(state[1:3]) @ state[3:]) + GRAVITY * height

    def _moments(self) -> tuple[float, float, float]:
        """First moments of the rods about their joints, and what couples both (kg·m, kg·m, kg·m²)."""
        (m1, m2), (c1, c2), length = self.masses, self.centres, self.lengths[0]
        return m1 * c1 + m2 * length, m2 * c2, m2 * length * c2
