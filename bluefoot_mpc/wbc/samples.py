"""Random whole-body inputs and problems, from quiet standing to hopeless: for tests and stress runs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from bluefoot_mpc.qp import QpProblem
from bluefoot_mpc.types import FloatArray
from bluefoot_mpc.wbc.assembly import Assembly
from bluefoot_mpc.wbc.config import WholeBodyConfig
from bluefoot_mpc.wbc.inputs import WholeBodyInputs
from bluefoot_mpc.wbc.model import WholeBodyModel


@dataclass(frozen=True, kw_only=True, slots=True)
class Spread:
    """Standard deviations of a random input around standing at rest, and who may lift."""

    joints: float = 0.1  # rad
    tilt: float = 0.1  # rad, trunk
    speed: float = 1.0  # rad/s, joints and trunk
    velocity: float = 0.1  # m/s
    reference: float = 0.02  # m, rad: errors of position and orientation
    acceleration: float = 1.0  # m/s², rad/s²
    slope: float = 0.05  # of the ground
    swing: float = 0.4  # chance of each foot to be in the air

    def scaled(self, factor: float) -> Spread:
        """Wider or narrower, but the chances of contact."""
        return Spread(
            joints=self.joints * factor, tilt=self.tilt * factor, speed=self.speed * factor,
            velocity=self.velocity * factor, reference=self.reference * factor,
            acceleration=self.acceleration * factor, slope=self.slope * factor, swing=self.swing,
        )  # fmt: skip


def sample_inputs(
    model: WholeBodyModel,
    rng: np.random.Generator,
    spread: Spread | None = None,
    start: FloatArray | None = None,
) -> WholeBodyInputs:
    """A random state with references near it.

    Args:
        model: the robot.
        rng: source of randomness.
        spread: how far from rest.
        start: (nq,) configuration to start from, e.g. one of a log; by default the model's posture.
    """
    s, pin_model, feet = spread or Spread(), model.pin_model, len(model.feet)
    step = np.concatenate(
        [np.zeros(3), rng.normal(size=3) * s.tilt, rng.normal(size=model.joints) * s.joints]
    )
    q = np.array(pin.integrate(pin_model, model.posture if start is None else start, step))
    v = rng.normal(size=pin_model.nv) * s.speed
    v[:3] = rng.normal(size=3) * s.velocity
    data = pin_model.createData()
    pin.framesForwardKinematics(pin_model, data, q)
    com = np.array(pin.centerOfMass(pin_model, data, q))
    points = np.array([data.oMf[frame].translation for frame in model.frames])
    turn = np.concatenate([np.zeros(3), rng.normal(size=3) * s.reference, np.zeros(model.joints)])
    turned = pin.integrate(pin_model, q, turn)
    normal = np.array([*(rng.normal(size=2) * s.slope), 1.0])
    return WholeBodyInputs(
        q=q, v=v, contact=rng.random(feet) >= s.swing,
        com=com + rng.normal(size=3) * s.reference, com_velocity=rng.normal(size=3) * s.velocity,
        com_acceleration=rng.normal(size=3) * s.acceleration,
        trunk=np.array(turned[3:7]), trunk_velocity=rng.normal(size=3) * s.velocity,
        trunk_acceleration=rng.normal(size=3) * s.acceleration,
        foot=points + rng.normal(size=(feet, 3)) * s.reference,
        foot_velocity=rng.normal(size=(feet, 3)) * s.velocity,
        foot_acceleration=rng.normal(size=(feet, 3)) * s.acceleration,
        posture=q[7:] + rng.normal(size=model.joints) * s.reference,
        remaining=rng.uniform(0.0, 0.3, feet), ground=normal / np.linalg.norm(normal),
        voltage=model.actuators.nominal_voltage * rng.uniform(0.8, 1.05), derating=rng.uniform(0.5, 1.0),
    )  # fmt: skip


def sample_problems(
    model: WholeBodyModel, seed: int, config: WholeBodyConfig | None = None, starts: FloatArray | None = None
) -> Iterator[QpProblem]:
    """Endless problems of random size and difficulty; each is overwritten by the next of its contacts.

    Args:
        model: the robot.
        seed: of the sequence.
        config: weights and limits.
        starts: (m, nq) configurations to start from, e.g. of a log.
    """
    rng, assembly = np.random.default_rng(seed), Assembly(model, config or WholeBodyConfig())
    while True:
        spread = Spread().scaled(10.0 ** rng.uniform(-3.0, 0.8))
        start = None if starts is None else starts[rng.integers(len(starts))]
        inputs = sample_inputs(model, rng, spread, start)
        assembly.fill(inputs, 0.02)
        yield assembly.assemble(inputs.contact).problem
