"""What stands in for the optimum when there is none: nearest point, static stance.

Neither is on the hot path: both allocate, and take tenths of a millisecond.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from bluefoot_mpc.qp.problem import QpProblem
from bluefoot_mpc.types import BoolArray, FloatArray
from bluefoot_mpc.wbc.constraints.friction import onto_pyramid
from bluefoot_mpc.wbc.model import WholeBodyModel

_ROUNDS = 40
_SHORTEST = 1e-6  # step of the line search
_SETTLED = 1e-12  # fall of the cost that a step promises, relative
_PENALTY = 1e4  # of a squared violation, over the mean of the cost's diagonal


def nearest_point(problem: QpProblem) -> FloatArray | None:
    """(n,) the optimum with rows and bounds as steep penalties; None where even that has none.

    Works on problems without a feasible point: newton's method on a convex function that
    is quadratic in pieces, with a line search, so that it cannot cycle.
    """
    size = len(problem.gradient)
    matrix = np.vstack([problem.matrix, np.eye(size)])
    lower = np.concatenate([problem.lower, problem.floor])
    upper = np.concatenate([problem.upper, problem.ceiling])
    hessian, gradient = problem.hessian, problem.gradient
    if (
        not all(np.isfinite(part).all() for part in (hessian, gradient, matrix))
        or np.isnan([lower, upper]).any()
    ):
        return None
    penalty = _PENALTY * float(np.trace(hessian)) / size

    def excess(x: FloatArray) -> FloatArray:
        value = matrix @ x
        return np.asarray(value - np.clip(value, lower, upper))

    def cost(x: FloatArray) -> float:
        over = excess(x)
        return float(0.5 * x @ hessian @ x + gradient @ x + 0.5 * penalty * over @ over)

    x = np.clip(np.zeros(size), problem.floor, problem.ceiling)
    for _ in range(_ROUNDS):
        over = excess(x)
        rows = matrix[over != 0.0]
        slope = hessian @ x + gradient + penalty * matrix.T @ over
        step = -np.linalg.solve(hessian + penalty * rows.T @ rows, slope)
        start, descent, length = cost(x), float(slope @ step), 1.0
        while cost(x + length * step) > start + 1e-4 * length * descent and length > _SHORTEST:
            length *= 0.5
        x = x + length * step
        if -descent <= _SETTLED * (1.0 + abs(start)):
            break
    return x if np.isfinite(x).all() else None


def into_limits(model: WholeBodyModel, problem: QpProblem, x: FloatArray, friction: float) -> FloatArray:
    """(n,) x with accelerations inside their bounds and forces inside pyramids and caps."""
    inside = np.clip(x, problem.floor, problem.ceiling)
    forces = inside[model.joints :].reshape(-1, 3)
    caps = problem.ceiling[model.joints + 2 :: 3]
    inside[model.joints :] = onto_pyramid(forces, friction, caps).reshape(-1)
    return inside


def static_forces(model: WholeBodyModel, q: FloatArray, contact: BoolArray) -> FloatArray:
    """(k, 3) N, vertical forces that carry the weight with the least moment left over; zero without contact.

    Args:
        model: the robot.
        q: (nq,) configuration.
        contact: (k,) feet that stand.
    """
    data = model.pin_model.createData()
    pin.framesForwardKinematics(model.pin_model, data, q)
    com = np.array(pin.centerOfMass(model.pin_model, data, q))
    standing = np.flatnonzero(contact)
    forces = np.zeros((len(model.feet), 3))
    if len(standing) == 0:
        return forces
    levers = np.array([data.oMf[model.frames[i]].translation - com for i in standing])
    share = model.weight / len(standing)
    # Sum and both tilting moments, in N; away from an even share as little as needed.
    balance = np.vstack([np.ones(len(standing)), levers[:, 0] / model.size, levers[:, 1] / model.size])
    error = np.array([model.weight, 0.0, 0.0]) - balance.sum(axis=1) * share
    normal = np.maximum(share + np.linalg.pinv(balance, rcond=1e-3) @ error, 0.0)
    forces[standing, 2] = normal * (model.weight / max(float(normal.sum()), 1e-9))
    return forces


def static_torque(model: WholeBodyModel, q: FloatArray, forces: FloatArray) -> FloatArray:
    """(nj,) N·m that hold the robot at rest under the ground's forces (k, 3), N, world axes."""
    pin_model = model.pin_model
    data = pin_model.createData()
    torque = np.array(pin.computeGeneralizedGravity(pin_model, data, q))
    pin.computeJointJacobians(pin_model, data, q)
    pin.updateFramePlacements(pin_model, data)
    for frame, force in zip(model.frames, forces, strict=True):
        jacobian = pin.getFrameJacobian(pin_model, data, frame, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
        torque -= jacobian[:3].T @ force
    return torque[6:]
