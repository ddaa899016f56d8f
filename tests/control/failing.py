"""Solvers that fail when they are told to, in a whole supervised pipeline on the simulated robot."""

from dataclasses import replace

import numpy as np

from bluefoot_mpc import qp
from bluefoot_mpc.control.config import ControlConfig
from bluefoot_mpc.control.presets import preset
from bluefoot_mpc.qp import QpProblem, QpSolution, QpStatus
from bluefoot_mpc.types import Fallback
from bluefoot_mpc.wbc import controller as whole_body
from bluefoot_mpc.zmp.preview import controller as preview
from bluefoot_mpc.zmp.preview.program import PreviewProgram, ProgramResult
from tests.control.closed_loop import Trace

NO_X = {"failed": QpStatus.FAILED, "infeasible": QpStatus.INFEASIBLE, "late": QpStatus.MAX_ITERATIONS}
RUBBISH = {"nan": np.nan, "rubbish": 1e3}


class Failure:
    """How solvers fail at present, and whether what stands in for them fails as well.

    Attributes:
        kind: a key of `NO_X` or `RUBBISH`; None while solvers work.
        helpers: True where approximations without a solver fail, too.
    """

    def __init__(self, *, helpers: bool) -> None:
        self.kind: str | None = None
        self.helpers = helpers

    def answer(self, solver: qp.Solver, problem: QpProblem) -> QpSolution:
        if self.kind is None:
            return solver.solve(problem)
        status = NO_X.get(self.kind, QpStatus.SOLVED)
        x = np.full(len(problem.gradient), RUBBISH.get(self.kind, np.nan))
        return QpSolution(x=x, status=status)

    def during(self, source, start: float, end: float, kind: str = "failed"):
        """The command source, which lets solvers fail from `start` to `end` (s) on its way."""

        def watched(time: float):
            self.kind = kind if start - 1e-9 <= time < end - 1e-9 else None
            return source(time)

        return watched


class _Switched:
    def __init__(self, solver: qp.Solver, failure: Failure) -> None:
        self._solver, self._failure = solver, failure

    def solve(self, problem: QpProblem) -> QpSolution:
        return self._failure.answer(self._solver, problem)

    def reset(self) -> None:
        self._solver.reset()


def break_whole_body(monkeypatch, *, helpers: bool) -> Failure:
    """From now on whole-body controllers are made with solvers that can fail."""
    failure = Failure(helpers=helpers)
    nearest = whole_body.nearest_point
    monkeypatch.setattr(whole_body, "make_solver", lambda *a: _Switched(qp.make_solver(*a), failure))
    monkeypatch.setattr(
        whole_body, "nearest_point", lambda p: None if failure.kind and failure.helpers else nearest(p)
    )
    return failure


def break_preview(monkeypatch, *, helpers: bool) -> Failure:
    """From now on previews are made with solvers that can fail."""
    failure = Failure(helpers=helpers)
    approximate = PreviewProgram.approximate
    monkeypatch.setattr(preview, "make_solver", lambda *a: _Switched(qp.make_solver(*a), failure))

    def maybe(program, problem):
        failed = failure.kind and failure.helpers
        return ProgramResult(solved=False, iterations=0) if failed else approximate(program, problem)

    monkeypatch.setattr(PreviewProgram, "approximate", maybe)
    return failure


def always_solving() -> ControlConfig:
    """The mpc preset, without the short cut that needs no solver as long as no limit is met."""
    config = preset("mpc")
    problem = replace(config.whole_body.problem, free_first=False)
    return replace(config, whole_body=replace(config.whole_body, problem=problem))


def rungs(trace: Trace, stage: str) -> list[Fallback]:
    """Rungs of a stage (``preview`` or ``whole_body``) in the order in which they were met."""
    plans = [output.telemetry.plan for output in trace.outputs]
    seen = [getattr(plan, stage) for plan in plans if plan is not None]
    return [rung for before, rung in zip([None, *seen], seen, strict=False) if rung is not before]


def failures(trace: Trace) -> int:
    """Solves without a usable answer, over the run."""
    plans = [output.telemetry.plan for output in trace.outputs]
    return sum(plan.qp_failures for plan in plans if plan is not None)


def finite(trace: Trace) -> bool:
    """True when nothing that was sent to the servos was anything but a number."""
    commands = [output.command for output in trace.outputs]
    return all(np.isfinite(c.position).all() and np.isfinite(c.torque_limit).all() for c in commands)
