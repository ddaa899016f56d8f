"""Agreement of Pinocchio and MuJoCo on one robot: both load the same URDF text."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from bluefoot_mpc.model.dynamics import Dynamics
from bluefoot_mpc.model.parameters import RobotParameters
from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.sim.convert import q_to_mujoco, v_to_mujoco, velocity_map, velocity_map_rate
from bluefoot_mpc.types import LEGS, N_LEGS, FloatArray

TOLERANCE = 1e-10
"""Largest relative error that counts as agreement."""

Terms = dict[str, FloatArray]


@dataclass(frozen=True, kw_only=True, slots=True)
class ParityReport:
    """Largest relative error of each quantity over random states.

    Attributes:
        states: number of states compared.
        mass: kg, the robot's total mass.
        errors: quantity to largest relative error: the largest entry of the
            difference over the largest entry of Pinocchio's value. Mass matrix
            and forces are first scaled by the square roots of the mass matrix's
            diagonal, so that a light link's entries count like the trunk's.
        tolerance: what every error must stay under.
    """

    states: int
    mass: float
    errors: dict[str, float]
    tolerance: float = TOLERANCE

    @property
    def agree(self) -> bool:
        """True where every error is finite and at most the tolerance."""
        return all(error <= self.tolerance for error in self.errors.values())

    @property
    def worst(self) -> float:
        """Largest relative error of all quantities."""
        return max(self.errors.values())


def check_parity(parameters: RobotParameters, n: int = 1000, seed: int = 0) -> ParityReport:
    """Compare both engines at random states.

    Args:
        parameters: the robot.
        n: number of states; trunk anywhere within a metre and in any attitude,
            joints within the mechanism's limits, brisk velocities.
        seed: of the states.
    """
    robot = RobotModel(parameters)
    dynamics = Dynamics(robot)
    model = mujoco_model(robot.urdf)
    data = mujoco.MjData(model)
    rng = np.random.default_rng(seed)
    errors: dict[str, float] = {}
    for _ in range(n):
        q, v = random_state(robot, rng)
        expected = pinocchio_terms(dynamics, q, v)
        actual = mujoco_terms(model, data, q, v)
        for name, error in relative_errors(actual, expected).items():
            errors[name] = max(errors.get(name, 0.0), error)
    return ParityReport(states=n, mass=dynamics.mass, errors=errors)


def mujoco_model(urdf: str) -> mujoco.MjModel:
    """MuJoCo's model of the bare floating robot: no floor, no servos."""
    spec = mujoco.MjSpec.from_string(urdf)
    spec.option.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    spec.body("trunk").add_freejoint()
    return spec.compile()


def random_state(robot: RobotModel, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """(23,) q inside the mechanism's limits and (22,) v up to a few m/s and rad/s."""
    quaternion = rng.normal(size=4)
    joints = rng.uniform(robot.pin_model.lowerPositionLimit[7:], robot.pin_model.upperPositionLimit[7:])
    q = np.concatenate([rng.uniform(-1.0, 1.0, 3), quaternion / np.linalg.norm(quaternion), joints])
    return q, rng.normal(scale=3.0, size=22)


def pinocchio_terms(dynamics: Dynamics, q: FloatArray, v: FloatArray) -> Terms:
    """What is compared, as Pinocchio computes it at q (23,) and v (22,)."""
    return {
        "mass": np.array([dynamics.mass]),
        "com": dynamics.com(q),
        "foot_positions": dynamics.foot_positions(q),
        "mass_matrix": dynamics.mass_matrix(q),
        "bias": dynamics.bias(q, v),
        "gravity": dynamics.gravity(q),
        "foot_jacobians": dynamics.foot_jacobians(q),
    }


def mujoco_terms(model: mujoco.MjModel, data: mujoco.MjData, q: FloatArray, v: FloatArray) -> Terms:
    """What is compared, as MuJoCo computes it, in the house's coordinates."""
    transform = velocity_map(q)
    gravity = _bias_force(model, data, q, np.zeros(model.nv))
    bias = _bias_force(model, data, q, v)
    matrix = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, matrix)
    trunk = model.body("trunk").id
    feet = [model.body(f"{leg}_foot").id for leg in LEGS]
    jacobians = np.zeros((N_LEGS, 3, model.nv))
    for leg, body in enumerate(feet):
        mujoco.mj_jacBody(model, data, jacobians[leg], None, body)
    return {
        "mass": np.array([model.body_subtreemass[trunk]]),
        "com": data.subtree_com[trunk].copy(),
        "foot_positions": data.xpos[feet],
        "mass_matrix": transform.T @ matrix @ transform,
        "bias": transform.T @ (bias + matrix @ velocity_map_rate(q, v)),
        "gravity": transform.T @ gravity,
        "foot_jacobians": jacobians @ transform,
    }


def relative_errors(actual: Terms, expected: Terms) -> dict[str, float]:
    """Relative error of each quantity at one state, as `ParityReport.errors` defines it."""
    scale = 1.0 / np.sqrt(np.diag(expected["mass_matrix"]))
    weights = {"mass_matrix": np.outer(scale, scale), "bias": scale, "gravity": scale}
    errors = {}
    for name, value in expected.items():
        weight = weights.get(name, np.ones(1))
        error = float(np.abs((actual[name] - value) * weight).max() / np.abs(value * weight).max())
        errors[name] = error if np.isfinite(error) else float("inf")
    return errors


def _bias_force(model: mujoco.MjModel, data: mujoco.MjData, q: FloatArray, v: FloatArray) -> FloatArray:
    data.qpos[:] = q_to_mujoco(q)
    data.qvel[:] = v_to_mujoco(q, v)
    mujoco.mj_forward(model, data)
    return np.array(data.qfrc_bias)
