"""Time of the preview's solve against solvers that are given the same problem plainly.

    OMP_NUM_THREADS=1 python benchmarks/preview_solvers.py [--samples 16 32 75] [--instances 100000] [--json]

Instances are supports of walks and trots of the real gait, seen from starts off the plan, with changing
heights; only those whose unconstrained optimum breaks a row are timed, because the others need
no solver. All competitors see each instance in turn, in one process.

- ``ours, NAME``: from start and references to the path, with NAME as the backend of the small problems.
  ``ours, whole step`` adds supports, rows, margins and the plan.
- ``plain, NAME``: the problem in jerks of both axes with a slack for every constrained point,
  assembled before and not counted; NAME sets up, factors and solves it anew. The only difference
  from ours is that rows of one point share their slack.
- ``hard, daqp``: the same without slacks; it has no answer where the rows leave none.
- ``box, daqp``: two problems of one axis each, whose supports are the boxes around the real ones; not
  the same problem, but the least that a refactoring solve can be.

The failures are those of our default over as many instances as asked for, solver called or not.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import time
from collections import defaultdict

import daqp
import numpy as np

from bluefoot_mpc.gait.gait import Gait, GaitConfig, GaitInputs
from bluefoot_mpc.model.parameters import GRAVITY
from bluefoot_mpc.qp import QpProblem, QpSize, SolverOptions, installed_solvers, make_solver
from bluefoot_mpc.types import Fallback
from bluefoot_mpc.zmp.preview import PreviewConfig, PreviewController, PreviewInputs
from bluefoot_mpc.zmp.support import FAR

HORIZON = 1.28
FEET = np.array([[0.165, 0.165, 0], [0.165, -0.165, 0], [-0.165, 0.165, 0], [-0.165, -0.165, 0]])
BACKENDS = ("daqp", "proxsuite", "quadprog", "piqp")
PLAIN = ("proxsuite", "quadprog", "piqp", "casadi-qpoases")
BUDGET = 8.0
"""s that one competitor may take in all; the slow ones see fewer instances."""


def schedules(config, count, rng):
    """Schedules, velocity and yaw rate of walks and trots at random moments."""
    found = []
    while len(found) < count:
        walks = rng.random() < 0.6
        gait = Gait(GaitConfig(), FEET)
        speed = rng.uniform(0.02, 0.06) if walks else rng.uniform(0.05, 0.4)
        wish = GaitInputs(
            velocity=np.array([speed, rng.normal() * 0.2 * speed]),
            yaw_rate=float(rng.normal() * 0.2),
            gait="walk" if walks else "trot",
        )
        for tick in range(200):
            now = gait.step(wish, 0.02)
            if tick > 40 and tick % 10 == 0:
                schedule = gait.schedule(config.samples * config.interval, config.interval)
                found.append((schedule, now.velocity.copy(), now.yaw_rate))
    return found[:count]


def instance(config, pool, rng, scale):
    """Inputs of the preview at a random moment, from a start off the plan."""
    schedule, velocity, yaw_rate = pool[rng.integers(len(pool))]
    turn = yaw_rate * schedule.time
    forward = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    left = np.stack([-np.sin(turn), np.cos(turn)], axis=1)
    speeds = velocity[0] * forward + velocity[1] * left
    nominal = np.cumsum(speeds, axis=0) * config.interval
    start = rng.normal(size=(3, 2)) * scale * [[0.01], [0.05], [0.3]]
    start[1] += velocity
    height = config.height * rng.uniform(0.8, 1.2) if rng.random() < 0.5 else None
    return PreviewInputs(
        schedule=schedule, nominal=nominal, velocity=speeds, heading=turn, state=start, height=height
    )


class Plain:
    """The plain problem of what the preview has read."""

    def __init__(self, controller):
        self.config, self.maps = controller.config, controller.maps
        self.problem = controller._problem
        n = self.config.samples
        weights = self.config.weights
        self.prices = np.repeat(
            [weights.support_slack, weights.reach_slack, weights.capture_slack], [n, n, 1]
        )
        hessian, slacks = self.maps.hessian, np.diag(self.prices)
        self.unit = 1e-3
        self.size = QpSize(variables=4 * n + 1, rows=8 * n + 4)
        self.qp = QpProblem.empty(self.size)
        self.qp.hessian[:] = 0.0
        self.qp.hessian[:n, :n] = self.qp.hessian[n : 2 * n, n : 2 * n] = hessian
        self.qp.hessian[2 * n :, 2 * n :] = slacks
        self.qp.matrix[:, 2 * n :] = -np.kron(np.eye(2 * n + 1), np.ones((4, 1)))
        # Unknowns in units in which the hessian's diagonal is one: fair to every solver.
        self.scale = 1.0 / np.sqrt(self.qp.hessian.diagonal())
        self.qp.hessian *= self.scale[:, None] * self.scale

    def assemble(self):
        """Rows and cost of the present instance, lengths in millimetres."""
        n, problem, qp = self.config.samples, self.problem, self.qp
        position, velocity, acceleration = self.maps.forced.reshape(3, n, n)
        levers, given = problem.levers, problem.given
        points = np.vstack(
            [
                position - levers[:, None] * acceleration,
                position,
                position[-1] + np.sqrt(levers[-1]) * velocity[-1],
            ]
        )
        free = (self.maps.free @ given[:3]).reshape(3, n, 2)
        rest = np.vstack(
            [
                free[0] - levers[:, None] * free[2],
                free[0],
                free[0, -1] + np.sqrt(levers[-1]) * free[1, -1],
            ]
        )
        offsets = np.vstack([problem._offsets, problem._offsets[n - 1]]).ravel()
        qp.upper[:] = offsets
        for axis in range(2):
            own, normal = slice(axis * n, (axis + 1) * n), problem.normals[:, axis]
            qp.matrix[:, own] = np.repeat(points, 4, axis=0) * normal[:, None] * self.scale[own]
            qp.upper -= np.repeat(rest[:, axis], 4) * normal
            qp.gradient[own] = self.scale[own] * (self.maps.gradient @ given[:, axis])
        qp.matrix[:, 2 * n :] = -np.kron(np.eye(2 * n + 1), np.ones((4, 1))) * self.scale[2 * n :]
        qp.gradient /= self.unit
        qp.upper /= self.unit
        self.real = offsets < 0.5 * FAR
        self.points, self.rest = points, rest

    def positions(self, x):
        """(n, 2) m of an answer."""
        n = self.config.samples
        jerks = (self.unit * self.scale[: 2 * n] * x[: 2 * n]).reshape(2, n).T
        return self.maps.forced[:n] @ jerks + self.maps.free[:n] @ self.problem.given[:3]


def daqp_solve(hessian, gradient, matrix, upper, lower=None):
    """Seconds, answer (None without one) of daqp from nothing."""
    low = np.full(len(upper), -1e30) if lower is None else lower
    sense = np.zeros(len(upper), dtype=np.int32)
    begin = time.perf_counter()
    x, _, flag, _ = daqp.solve(
        hessian, gradient, matrix, upper, low, sense, primal_tol=1e-8, iter_limit=10000
    )
    return time.perf_counter() - begin, x if flag == 1 else None


def time_plain_daqp(plain):
    keep, qp = plain.real, plain.qp
    matrix, upper = np.ascontiguousarray(qp.matrix[keep]), qp.upper[keep]
    return daqp_solve(qp.hessian, qp.gradient, matrix, upper)


def time_hard_daqp(plain):
    keep, qp, n = plain.real, plain.qp, plain.config.samples
    hessian = np.ascontiguousarray(qp.hessian[: 2 * n, : 2 * n])
    matrix, upper = np.ascontiguousarray(qp.matrix[keep, : 2 * n]), qp.upper[keep]
    return daqp_solve(hessian, qp.gradient[: 2 * n].copy(), matrix, upper)


def time_box_daqp(plain):
    """Both axes one after the other, ZMP and reach between the bounds of a box around their polygons."""
    n, problem, qp, total = plain.config.samples, plain.problem, plain.qp, 0.0
    for axis in range(2):
        own = slice(axis * n, (axis + 1) * n)
        ends = problem._edges[:, :, :, axis].reshape(n, -1)
        middle = problem.given[3 + n : 3 + 2 * n, axis]
        high = np.concatenate([ends.max(axis=1), middle + problem._reach[:, axis]])
        low = np.concatenate([ends.min(axis=1) - 1e-3, middle - problem._reach[:, axis]])
        rest = plain.rest[: 2 * n, axis]
        matrix = np.ascontiguousarray(plain.points[: 2 * n] * plain.scale[own])
        hessian = np.ascontiguousarray(qp.hessian[own, own])
        seconds, x = daqp_solve(
            hessian, qp.gradient[own].copy(), matrix, (high - rest) / plain.unit, (low - rest) / plain.unit
        )
        total += seconds
    return total, None if x is None else np.zeros(1)


class Clock:
    """Times and failures of one competitor."""

    def __init__(self):
        self.times, self.failed, self.spent, self.gap = [], 0, 0.0, []

    def note(self, seconds, solved, gap=None):
        self.times.append(seconds)
        self.spent += seconds
        self.failed += not solved
        if gap is not None:
            self.gap.append(gap)

    def summary(self):
        times = 1e6 * np.array(self.times)
        return {
            "instances": len(times),
            "median_us": float(np.median(times)),
            "p99_us": float(np.percentile(times, 99)),
            "failed": self.failed,
            "largest_gap_m": max(self.gap, default=None),
        }


def ours(controller, count=3):
    """Least seconds of a few solves of what the controller's problem has read; and whether it was solved."""
    problem, program, best = controller._problem, controller._program, np.inf
    for _ in range(count):
        begin = time.perf_counter()
        np.matmul(controller._by_law, problem.given, out=problem.path)
        problem.evaluate()
        result = program.solve(problem)
        best = min(best, time.perf_counter() - begin)
    return best, result.solved


def compare(samples, count, rng):
    """Summaries of all competitors at one length of the horizon."""
    config = PreviewConfig(samples=samples, interval=HORIZON / samples)
    pool = schedules(config, 200, rng)
    installed = installed_solvers()
    controllers = {
        name: PreviewController(dataclasses.replace(config, solver=name))
        for name in BACKENDS
        if name in installed
    }
    first = controllers["daqp"]
    plain = Plain(first)
    options = SolverOptions(warm_start=False, max_iterations=20000)
    plain_solvers = {name: make_solver(name, plain.size, options) for name in PLAIN if name in installed}
    clocks = defaultdict(Clock)
    seen = 0
    while seen < count:
        inputs = instance(config, pool, rng, rng.choice([0.3, 1.0, 2.0]))
        begin = time.perf_counter()
        plan = first.step(inputs, 0.02)
        whole = time.perf_counter() - begin
        if plan.iterations == 0:
            continue
        seen += 1
        clocks["ours, whole step"].note(whole, plan.status is Fallback.SOLVED)
        for name, controller in controllers.items():
            controller._problem.read(inputs, inputs.state)
            clocks[f"ours, {name}"].note(*ours(controller))
        best = first._problem.path[:samples].copy()
        plain.assemble()
        timed = {"plain, daqp": time_plain_daqp, "hard, daqp": time_hard_daqp, "box, daqp": time_box_daqp}
        for name, run in timed.items():
            if clocks[name].spent < BUDGET:
                seconds, x = min((run(plain) for _ in range(3)), key=lambda pair: pair[0])
                gap = (
                    np.abs(plain.positions(x) - best).max()
                    if name == "plain, daqp" and x is not None
                    else None
                )
                clocks[name].note(seconds, x is not None, gap)
        for name, solver in plain_solvers.items():
            clock = clocks[f"plain, {name}"]
            if clock.spent < BUDGET:
                begin = time.perf_counter()
                solution = solver.solve(plain.qp)
                seconds = time.perf_counter() - begin
                clock.note(seconds, solution.ok)
    return {name: clock.summary() for name, clock in clocks.items()}


def failures(instances, rng):
    """How our default ends over many instances, hard ones among them."""
    config = PreviewConfig()
    controller, pool = PreviewController(config), schedules(config, 1000, rng)
    ends, calls, slow = defaultdict(int), 0, []
    for _ in range(instances):
        inputs = instance(config, pool, rng, rng.choice([0.0, 0.3, 1.0, 3.0, 10.0]))
        begin = time.perf_counter()
        plan = controller.step(inputs, 0.02)
        slow.append(time.perf_counter() - begin)
        ends[plan.status.name] += 1
        calls += plan.iterations > 0
    times = 1e6 * np.array(slow)
    return {
        "instances": instances,
        "ends": dict(ends),
        "solver_called": calls,
        "step_median_us": float(np.median(times)),
        "step_p99_us": float(np.percentile(times, 99)),
    }


def show(result):
    for samples, rows in result["horizons"].items():
        reference = rows["plain, daqp"]["median_us"]
        print(f"N = {samples}, {HORIZON} s")
        for name, row in sorted(rows.items(), key=lambda item: item[1]["median_us"]):
            print(
                f"  {name:24s} {row['median_us']:10.1f} µs  p99 {row['p99_us']:10.1f}"
                f"  {row['median_us'] / reference:6.3f}x  failed {row['failed']} of {row['instances']}"
            )
    print(result["failures"])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--samples", type=int, nargs="+", default=[16, 32, 75])
    parser.add_argument("--timed", type=int, default=150, help="instances that are timed per length")
    parser.add_argument("--instances", type=int, default=100_000, help="instances whose failures are counted")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--json", action="store_true", help="print JSON instead of a table")
    arguments = parser.parse_args()
    rng = np.random.default_rng(arguments.seed)
    result = {
        "height_m": PreviewConfig().height,
        "gravity": GRAVITY,
        "horizons": {str(n): compare(n, arguments.timed, rng) for n in arguments.samples},
        "failures": failures(arguments.instances, rng),
    }
    if arguments.json:
        print(json.dumps(result, indent=2))
    else:
        show(result)


if __name__ == "__main__":
    main()
