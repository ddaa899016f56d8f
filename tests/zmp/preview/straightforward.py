"""The preview's problem written down plainly: jerks of both axes and one slack for every row."""

import numpy as np

from bluefoot_mpc.model.parameters import GRAVITY
from bluefoot_mpc.qp import QpProblem, QpSize


def rollout(config):
    """(3n, 3) and (3n, n): positions, velocities, accelerations by start and jerks, by stepping."""
    n, t = config.samples, config.interval
    a = np.array([[1.0, t, t * t / 2.0], [0.0, 1.0, t], [0.0, 0.0, 1.0]])
    b = np.array([t**3 / 6.0, t * t / 2.0, t])
    free, forced = np.zeros((n, 3, 3)), np.zeros((n, 3, n))
    state, jerks = np.eye(3), np.zeros((3, n))
    for k in range(n):
        state, jerks = a @ state, a @ jerks
        jerks[:, k] += b
        free[k], forced[k] = state, jerks
    return free.transpose(1, 0, 2).reshape(3 * n, 3), forced.transpose(1, 0, 2).reshape(3 * n, n)


def program(config, given, levers, normals, offsets):
    """Whole problem in jerks (2n) and slacks (8n + 4); arguments as in `PreviewProblem`."""
    n, weights = config.samples, config.weights
    free, forced = rollout(config)
    lever = config.height / GRAVITY
    start, references = given[:3], given[3:].reshape(3, n, 2)
    rows = 8 * n + 4
    problem = QpProblem.empty(QpSize(variables=2 * n + rows, rows=rows))
    prices = [weights.support_slack, weights.reach_slack, weights.capture_slack]
    problem.hessian[:] = np.diag(np.repeat([weights.jerk, *prices], [2 * n, 4 * n, 4 * n, 4]))
    tracked = (
        (weights.zmp, _zmp(forced, lever, n), _zmp(free, lever, n), references[0]),
        (weights.position, forced[:n], free[:n], references[1]),
        (weights.velocity, forced[n : 2 * n], free[n : 2 * n], references[2]),
    )
    problem.matrix[:, 2 * n :] = -np.eye(rows)
    problem.upper[:] = offsets
    for axis in range(2):
        own = slice(axis * n, (axis + 1) * n)
        for weight, by_jerk, by_start, wanted in tracked:
            problem.hessian[own, own] += weight * by_jerk.T @ by_jerk
            problem.gradient[own] += weight * by_jerk.T @ (by_start @ start[:, axis] - wanted[:, axis])
        points = _points(forced, levers, n)
        resting = _points(free, levers, n) @ start[:, axis]
        normal = normals[:, axis]
        problem.matrix[:, own] = np.repeat(points, 4, axis=0) * normal[:, None]
        problem.upper -= np.repeat(resting, 4) * normal
    return problem


def _zmp(path, lever, n):
    return path[:n] - np.reshape(lever, (-1, 1)) * path[2 * n :]


def _points(path, levers, n):
    capture = path[n - 1] + np.sqrt(levers[-1]) * path[2 * n - 1]
    return np.vstack([_zmp(path, levers, n), path[:n], capture[None]])
