"""What stands in for the optimum when there is none: widened limits, nearest point, static stance.

None of it is on the hot path: all of it allocates, and takes tenths of a millisecond.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from bluefoot_mpc.qp.problem import QpProblem
from bluefoot_mpc.types import BoolArray, FloatArray
from bluefoot_mpc.wbc.constraints.friction import onto_pyramid
from bluefoot_mpc.wbc.model import WholeBodyModel

_ROUNDS = 15
_SHORTEST = 1e-3  # step of the line search
_SETTLED = 1e-9  # fall of the cost that a step promises, relative
_WIDENING = 1e3  # cost of widened limits, over the largest of the problem's diagonal
_PENALTY = 1e4  # of a squared violation, over the mean of the cost's diagonal


def widened(problem: QpProblem, joints: int, unit: float) -> QpProblem:
    """The same problem with one more unknown, by which all limits of torque and acceleration give way.

    What makes a whole-body problem infeasible is these two against each other;
    forces alone can always be zero. The least common widening is wanted before
    everything else.

    Args:
        problem: n unknowns, the first `joints` accelerations, and as many rows of torque first.
        joints: number of joints.
        unit: rad/s² of acceleration limits given up per N·m of torque limits.
    """
    size, rows = len(problem.gradient), len(problem.lower)
    hessian = np.zeros((size + 1, size + 1))
    hessian[:size, :size] = problem.hessian
    hessian[size, size] = _WIDENING * float(np.max(np.diagonal(problem.hessian)))
    change = np.eye(joints, size)
    soft = np.vstack([problem.matrix[:joints], change])
    give = np.concatenate([np.ones(joints), np.full(joints, unit)])[:, None]
    upper = np.concatenate([problem.upper[:joints], problem.ceiling[:joints]])
    lower = np.concatenate([problem.lower[:joints], problem.floor[:joints]])
    hard = np.hstack([problem.matrix[joints:], np.zeros((rows - joints, 1))])
    endless = np.full(2 * joints, np.inf)
    free = np.full(joints, np.inf)
    return QpProblem(
        hessian=hessian,
        gradient=np.append(problem.gradient, 0.0),
        matrix=np.ascontiguousarray(np.vstack([np.hstack([soft, -give]), np.hstack([soft, give]), hard])),
        lower=np.concatenate([-endless, lower, problem.lower[joints:]]),
        upper=np.concatenate([upper, endless, problem.upper[joints:]]),
        floor=np.concatenate([-free, problem.floor[joints:], [0.0]]),
        ceiling=np.concatenate([free, problem.ceiling[joints:], [np.inf]]),
    )


def nearest_point(problem: QpProblem) -> FloatArray | None:
    """(n,) the optimum with rows and bounds as steep penalties; None where even that has none.

    Needs no solver: Newton's method on a convex function that is quadratic in pieces,
    with a line search, so that it cannot cycle, and few steps, so that it cannot be late.
    """
    matrix = np.vstack([problem.matrix, np.eye(len(problem.gradient))])
    lower = np.concatenate([problem.lower, problem.floor])
    upper = np.concatenate([problem.upper, problem.ceiling])
    hessian, gradient = problem.hessian, problem.gradient
    if (
        not all(np.isfinite(part).all() for part in (hessian, gradient, matrix))
        or np.isnan([lower, upper]).any()
    ):
        return None
    penalty = _PENALTY * float(np.trace(hessian)) / len(gradient)
    x = np.clip(np.zeros(len(gradient)), problem.floor, problem.ceiling)
    for _ in range(_ROUNDS):
        value = matrix @ x
        over = value - np.clip(value, lower, upper)
        rows = matrix[over != 0.0]
        slope = hessian @ x + gradient + penalty * matrix.T @ over
        try:
            step = -np.linalg.solve(hessian + penalty * rows.T @ rows, slope)
        except np.linalg.LinAlgError:  # numbers too large to add up
            return None
        x = x + _shortened(problem, x, step, penalty) * step
        if -float(slope @ step) <= _SETTLED * (1.0 + abs(float(gradient @ x))):
            break
    return x if np.isfinite(x).all() else None


def _shortened(problem: QpProblem, x: FloatArray, step: FloatArray, penalty: float) -> float:
    """Share of a step after which cost and penalties have fallen."""
    value, change = np.concatenate([problem.matrix @ x, x]), np.concatenate([problem.matrix @ step, step])
    lower = np.concatenate([problem.lower, problem.floor])
    upper = np.concatenate([problem.upper, problem.ceiling])
    first = float((problem.hessian @ x + problem.gradient) @ step)
    second = float(step @ problem.hessian @ step)

    def rise(length: float) -> float:
        moved = value + length * change
        moved -= np.clip(moved, lower, upper)
        return length * first + 0.5 * length * length * second + 0.5 * penalty * float(moved @ moved)

    start, length = rise(0.0), 1.0
    while rise(length) > start and length > _SHORTEST:
        length *= 0.5
    return length


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
