"""The preview controller: a motion of the centre of mass over the support regions ahead.

When there is no optimum, the plan comes from further down a ladder: an
approximate plan that was checked, the previous plan as long as it lasts, the
way to the middle of the feet.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.qp import SolverOptions, make_solver
from bluefoot_mpc.types import Fallback, FloatArray
from bluefoot_mpc.zmp.preview.config import PreviewConfig
from bluefoot_mpc.zmp.preview.inputs import PreviewInputs
from bluefoot_mpc.zmp.preview.kajita import gain_map
from bluefoot_mpc.zmp.preview.model import preview_maps
from bluefoot_mpc.zmp.preview.plan import ComPlan, carried, shifted
from bluefoot_mpc.zmp.preview.problem import PreviewProblem
from bluefoot_mpc.zmp.preview.program import PreviewProgram, Solver, sizes


class _Memory(NamedTuple):
    """A plan, the frame that it was made in, and when."""

    plan: ComPlan
    pose: FloatArray
    made: float


class PreviewController:
    """Plans the centre of mass from the contacts ahead.

    Args:
        config: law, sizes, weights and bounds.
        solvers: backends for problems of `program.sizes` in place of the
            configured one, for tests and benchmarks.

    Raises:
        UnknownNameError: there is no such law or solver.
    """

    def __init__(self, config: PreviewConfig, solvers: tuple[Solver, ...] | None = None) -> None:
        self.config = config
        self.maps = maps = preview_maps(config)
        self._problem = PreviewProblem(config, maps)
        if solvers is None:
            solvers = _solvers(config)
        self._program = PreviewProgram(config, maps, solvers)
        self._by_law = self._problem.path_map(gain_map(config) if config.law == "kajita" else maps.optimum)
        self._by_optimum = self._problem.path_map(maps.optimum)
        self.reset()

    def reset(self) -> None:
        """Forget every plan."""
        self._program.reset()
        self._clock = 0.0
        self._last: _Memory | None = None
        self._good: _Memory | None = None

    def step(self, inputs: PreviewInputs, dt: float) -> ComPlan:
        """Plan from now on.

        Args:
            inputs: contacts and wishes.
            dt: s since the previous plan.

        Raises:
            ConfigurationError: the inputs have another number of samples, or
                another time between them.
        """
        self._check(inputs)
        self._clock += dt
        pose = np.array(inputs.pose, dtype=float)
        if not np.isfinite(pose).all():
            pose = np.zeros(3) if self._last is None else self._last.pose
        start = self._start(inputs, pose)
        plan = self._planned() if self._problem.read(inputs, start) else None
        if plan is not None:
            self._good = _Memory(plan, pose, self._clock)
        else:
            plan = self._previous(pose) or self._to_stance(inputs, start, pose)
        self._last = _Memory(plan, pose, self._clock)
        return plan

    def _check(self, inputs: PreviewInputs) -> None:
        n = self.config.samples
        shape, nominal = inputs.schedule.stance.shape, np.shape(inputs.nominal)
        if (shape, nominal) != ((n, 4), (n, 2)):
            raise ConfigurationError(
                f"the preview has {n} samples, its schedule {shape[0]}, and nominal the shape {nominal}"
            )
        horizon, ahead = n * self.config.interval, float(inputs.schedule.time[-1])
        if not abs(ahead - horizon) < 0.01 * self.config.interval:
            raise ConfigurationError(f"the preview looks {horizon:g} s ahead, its schedule {ahead:g} s")

    def _start(self, inputs: PreviewInputs, pose: FloatArray) -> FloatArray:
        """(3, 2) state to start from: the given one, the previous plan's, or rest at the nominal place."""
        if inputs.state is not None:
            return np.asarray(inputs.state, dtype=float)
        if self._last is not None:
            state = self._last.plan.at(self._clock - self._last.made)
            return carried(state, self._last.pose, pose)
        return np.vstack([inputs.nominal[0], np.zeros((2, 2))])

    def _planned(self) -> ComPlan | None:
        """The plan of the configured law; None when it is not to be used."""
        problem, program = self._problem, self._program
        np.matmul(self._by_law, problem.given, out=problem.path)
        least = float(problem.evaluate().min())
        if not math.isfinite(least):
            return None
        status, iterations = Fallback.SOLVED, 0
        if self.config.law == "constrained" and least < 0.0:
            result = program.solve(problem)
            iterations = result.iterations
            if not result.solved:
                status = Fallback.NEAREST
                if not program.approximate(problem).solved:
                    return None
        return problem.plan(status, iterations)

    def _previous(self, pose: FloatArray) -> ComPlan | None:
        """What is left of the last plan that was made; None when nothing is."""
        if self._good is None:
            return None
        age = self._clock - self._good.made
        lasts = float(self._good.plan.time[-1]) - self.config.interval
        # Towards its end a plan is only as good as the last capture point: it is not followed that far.
        if not 0.0 <= age < min(self.config.shift_time, lasts):
            return None
        return shifted(self._good.plan, age, self._good.pose, pose)

    def _to_stance(self, inputs: PreviewInputs, start: FloatArray, pose: FloatArray) -> ComPlan:
        """The way to the middle of the present feet, at a limited speed."""
        feet, stance = inputs.schedule.footholds[0, :, :2], inputs.schedule.stance[0]
        if not np.isfinite(start).all():
            start = np.zeros((3, 2))
            if self._last is not None:
                start[0] = carried(self._last.plan.start, self._last.pose, pose)[0]
        standing = stance & np.isfinite(feet).all(axis=1)
        goal = feet[standing].mean(axis=0) if standing.any() else start[0]
        self._problem.read_way(start, goal)
        np.matmul(self._by_optimum, self._problem.given, out=self._problem.path)
        self._problem.evaluate()
        return self._problem.plan(Fallback.STANCE, 0)


def _solvers(config: PreviewConfig) -> tuple[Solver, ...]:
    # The rows of a problem are others every time: there is nothing to start from. The program checks answers.
    options = SolverOptions(warm_start=False, max_iterations=2000, verify=False)
    return tuple(make_solver(config.solver, size, options) for size in sizes(config))
