"""The preview over 32 samples: ours, and solvers that set up and factor the same problem on every tick.

``plain``: both axes in jerks, the rows of our problem with a slack for every
point. ``hard``: the same without slacks; it has no answer where the rows leave
none. ``box``: two problems of one axis each, supports and reach as boxes,
without slacks: not the same problem, but the least that a preview can be. The
peers' matrices are assembled before and not counted; ours are.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import daqp
import numpy as np
from preview_solvers import Plain

from bluefoot_mpc.qp import SolverOptions, make_solver
from bluefoot_mpc.zmp.preview import PreviewConfig, PreviewController, PreviewInputs

DT = 0.02
SOLVERS = ("proxsuite", "casadi-qpoases")
"""Others on the plain problem, by the names of `bluefoot_mpc.qp`."""


@dataclass(frozen=True, slots=True)
class Dense:
    """``min ½ xᵀ H x + gᵀ x`` with ``lower <= A x <= upper``, as daqp takes it."""

    hessian: np.ndarray
    gradient: np.ndarray
    matrix: np.ndarray
    upper: np.ndarray
    lower: np.ndarray

    def solve(self) -> int:
        """Set up, factor, solve; the exit flag (1: solved)."""
        sense = np.zeros(len(self.upper), dtype=np.int32)
        return daqp.solve(
            self.hessian, self.gradient, self.matrix, self.upper, self.lower, sense, iter_limit=10000
        )[2]


def with_states(inputs: list[PreviewInputs], config: PreviewConfig) -> list[PreviewInputs]:
    """Inputs with the state that the plan had reached in the run, so that any of them can stand alone."""
    controller = PreviewController(config)
    return [replace(i, state=controller.step(i, DT).start) for i in inputs]


def disturbed(inputs: list[PreviewInputs]) -> list[PreviewInputs]:
    """The same with starts off the plan, so that constraints are met."""
    rng = np.random.default_rng(0)
    spread = np.array([[0.003], [0.02], [0.1]])
    return [replace(i, state=i.state + spread * rng.normal(size=(3, 2))) for i in inputs]


class Peers:
    """The problems of every instance as the peers take them."""

    def __init__(self, config: PreviewConfig, inputs: list[PreviewInputs]) -> None:
        controller = PreviewController(config)
        plain = Plain(controller)
        self.plain: list[Dense] = []
        self.hard: list[Dense] = []
        self.box: list[tuple[Dense, Dense]] = []
        self.problems, self.size = [], plain.size
        for instance in inputs:
            controller._problem.read(instance, instance.state)
            plain.assemble()
            keep, qp = plain.real, plain.qp
            upper = qp.upper[keep].copy()
            self.plain.append(
                Dense(
                    qp.hessian.copy(), qp.gradient.copy(), np.ascontiguousarray(qp.matrix[keep]), upper,
                    np.full(len(upper), -1e30),
                )
            )  # fmt: skip
            self.hard.append(_hard(plain))
            self.problems.append(_copy(qp))
            self.box.append((_box(plain, 0), _box(plain, 1)))


def _hard(plain: Plain) -> Dense:
    keep, qp, jerks = plain.real, plain.qp, slice(2 * plain.config.samples)
    upper = qp.upper[keep].copy()
    return Dense(
        np.ascontiguousarray(qp.hessian[jerks, jerks]), qp.gradient[jerks].copy(),
        np.ascontiguousarray(qp.matrix[keep, jerks]), upper, np.full(len(upper), -1e30),
    )  # fmt: skip


def _box(plain: Plain, axis: int) -> Dense:
    n, problem, qp = plain.config.samples, plain.problem, plain.qp
    own = slice(axis * n, (axis + 1) * n)
    ends = problem._edges[:, :, :, axis].reshape(n, -1)
    middle = problem.given[3 + n : 3 + 2 * n, axis]
    high = np.concatenate([ends.max(axis=1), middle + problem._reach[:, axis]])
    low = np.concatenate([ends.min(axis=1) - 1e-3, middle - problem._reach[:, axis]])
    rest = plain.rest[: 2 * n, axis]
    return Dense(
        np.ascontiguousarray(qp.hessian[own, own]), qp.gradient[own].copy(),
        np.ascontiguousarray(plain.points[: 2 * n] * plain.scale[own]),
        (high - rest) / plain.unit, (low - rest) / plain.unit,
    )  # fmt: skip


def _copy(qp):
    names = ("hessian", "gradient", "matrix", "lower", "upper", "floor", "ceiling")
    return type(qp)(**{name: np.array(getattr(qp, name)) for name in names})


def contestants(inputs: list[PreviewInputs], peers: Peers, config: PreviewConfig) -> dict[str, object]:
    """Ours and daqp on these instances."""
    count, ours = len(inputs), PreviewController(config)
    return {
        "daqp refactoring, plain": lambda k: peers.plain[k % count].solve(),
        "daqp refactoring, hard": lambda k: peers.hard[k % count].solve(),
        "daqp refactoring, box, two axes": lambda k: [axis.solve() for axis in peers.box[k % count]],
        "ours, whole step": lambda k: ours.step(inputs[k % count], DT),
    }


def slow_contestants(peers: Peers) -> dict[str, object]:
    """Other solvers on the plain problem."""
    options, count = SolverOptions(warm_start=False, max_iterations=20000), len(peers.problems)
    found = {"daqp refactoring, plain": lambda k: peers.plain[k % count].solve()}
    for name in SOLVERS:
        solver = make_solver(name, peers.size, options)
        found[f"{name}, plain"] = lambda k, solver=solver: solver.solve(peers.problems[k % count])
    return found


def unsolved(peers: Peers) -> dict[str, float]:
    """Share of the instances that daqp has no answer to."""
    return {
        "plain_unsolved": float(np.mean([problem.solve() != 1 for problem in peers.plain])),
        "hard_unsolved": float(np.mean([problem.solve() != 1 for problem in peers.hard])),
        "box_unsolved": float(np.mean([any(axis.solve() != 1 for axis in pair) for pair in peers.box])),
    }


def solver_share(inputs: list[PreviewInputs], config: PreviewConfig) -> float:
    """Share of the instances that needed a solver at all."""
    ours = PreviewController(config)
    return float(np.mean([ours.step(i, DT).iterations > 0 for i in inputs]))
