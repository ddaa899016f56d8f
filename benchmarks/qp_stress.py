"""Solve very many quadratic programs by several solvers, and keep what went wrong.

    python benchmarks/qp_stress.py whole-body --count 1000000 --cold [--starts configurations.npy]
    python benchmarks/qp_stress.py body --count 20000 --solvers daqp,proxsuite,quadprog,casadi-daqp
    python benchmarks/qp_stress.py preview --count 20000 --fixed-matrices

A family of problems is a callable ``problems(seed) -> iterator of QpProblem``, named as
``module:callable``. Built in are the whole-body problems of random states (near those given by
``--starts``), and ``body`` and ``preview``, random ones of such sizes. A seed is one block:
solvers are reset at its start and see its problems in their order, so a block can be solved
again alone. Blocks done are kept in the result file and skipped by the next call of the same
kind; more can be added by a larger ``--count``. Within a block a family for
``--fixed-matrices`` must keep H and A. Problems may share arrays: what is kept is copied.

Times are processor time, so that other processes do not count. Every status is counted. What
is not solved, what differs between solvers and what has large KKT residuals is saved beside
the result file, up to a limit, and can be read back by `read_problem`. Exit status 1 if a
solver raised, if a status was none of the known ones, or if an answer called solved is not.
"""

from __future__ import annotations

import argparse
import functools
import importlib
import itertools
import json
import sys
import time
from collections import Counter
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np
from qp_families import FAMILIES, Problems

from bluefoot_mpc.qp import (
    QpProblem,
    QpSize,
    QpSolution,
    QpStatus,
    Solver,
    SolverOptions,
    make_solver,
    residuals,
)

ARRAYS = ("hessian", "gradient", "matrix", "lower", "upper", "floor", "ceiling")
WRITE_PERIOD = 20.0
"""s between two writes of the result file."""


@dataclass(kw_only=True)
class Setup:
    """What decides the result of a block."""

    family: str
    solvers: list[str]
    block: int
    options: dict[str, object]


@dataclass(kw_only=True)
class Tally:
    """What one solver did in one block."""

    statuses: Counter[str] = field(default_factory=Counter)
    raised: int = 0
    wrong: int = 0
    primal: float = 0.0
    worst_kkt: float = 0.0  # relative to 1 + |g|, where the solver gives multipliers
    difference: float = 0.0  # of x from the first solver's, relative to 1 + |x|
    iterations: int = 0  # largest
    times: list[float] = field(default_factory=list)  # us

    def summary(self) -> dict[str, object]:
        result = asdict(self)
        times = np.array(result.pop("times") or [np.nan])
        p50, p99 = np.percentile(times, [50, 99])
        result.update(statuses=dict(self.statuses), p50_us=p50, p99_us=p99, max_us=times.max())
        return result


class Bench:
    """Solves blocks and keeps failures."""

    def __init__(
        self, setup: Setup, options: SolverOptions, limits: tuple[float, float], failures: Path, keep: int
    ):
        self.setup = setup
        self.options = options
        self.kkt_limit, self.difference_limit = limits
        self.failures = failures
        self.keep = keep
        self.solvers: dict[tuple[str, QpSize], Solver] = {}

    def solve_block(self, problems: Problems, seed: int, length: int) -> dict[str, Tally]:
        for solver in self.solvers.values():
            solver.reset()
        tallies = {name: Tally() for name in self.setup.solvers}
        for index, problem in enumerate(itertools.islice(problems(seed), length)):
            self.solve_one(problem, tallies, f"{seed:06d}_{index:05d}")
        return tallies

    def solve_one(self, problem: QpProblem, tallies: dict[str, Tally], label: str) -> None:
        first: QpSolution | None = None
        for name, tally in tallies.items():
            key = (name, problem.size)
            if key not in self.solvers:
                self.solvers[key] = make_solver(name, problem.size, self.options)
            start = time.thread_time()
            try:
                solution = self.solvers[key].solve(problem)
            except Exception as error:  # whatever it is, it is what is looked for
                tally.raised += 1
                self.save(problem, f"{label}_{name}_raised", repr(error))
                continue
            tally.times.append(1e6 * (time.thread_time() - start))
            reasons = self.judge(problem, solution, tally, first)
            if reasons:
                self.save(problem, f"{label}_{name}", reasons)
            if first is None and solution.ok:
                first = QpSolution(x=solution.x.copy(), status=solution.status)

    def judge(self, problem: QpProblem, solution: QpSolution, tally: Tally, first: QpSolution | None) -> str:
        """What is wrong with an answer; empty if nothing."""
        tally.statuses[str(solution.status)] += 1
        tally.iterations = max(tally.iterations, solution.iterations)
        if not isinstance(solution.status, QpStatus):
            tally.wrong += 1
            return "unknown status"
        if not solution.ok:
            return f"status {solution.status}"
        found = residuals(problem, solution)
        scale = 1.0 + float(np.abs(problem.gradient).max())
        kkt = max(found.dual, found.complementarity) / scale
        tally.primal = max(tally.primal, found.primal)
        tally.worst_kkt = max(tally.worst_kkt, 0.0 if np.isnan(kkt) else kkt)
        reasons = []
        if not np.isfinite(solution.x).all() or found.primal > self.kkt_limit or kkt > self.kkt_limit:
            tally.wrong += 1
            reasons.append(f"called solved with {found}")
        if first is not None:
            gap = float(np.abs(solution.x - first.x).max() / (1.0 + np.abs(first.x).max()))
            tally.difference = max(tally.difference, gap)
            if gap > self.difference_limit:
                reasons.append(f"x differs by {gap:.1e} of its size from the first solver's")
        return "; ".join(reasons)

    def save(self, problem: QpProblem, label: str, why: str) -> None:
        if self.keep <= 0:
            return
        self.keep -= 1
        self.failures.mkdir(parents=True, exist_ok=True)
        arrays = {name: getattr(problem, name) for name in ARRAYS}
        np.savez_compressed(self.failures / f"{label}.npz", why=np.array(why), **arrays)


def read_problem(path: Path) -> tuple[QpProblem, str]:
    """A saved problem and why it was saved."""
    with np.load(path) as file:
        problem = QpProblem(**{name: np.ascontiguousarray(file[name]) for name in ARRAYS})
        return problem, str(file["why"])


def find_family(name: str) -> Problems:
    if name in FAMILIES:
        return FAMILIES[name]
    module, _, attribute = name.partition(":")
    if not attribute:
        sys.exit(f"'{name}' is none of {', '.join(FAMILIES)} and no module:callable")
    found: Problems = getattr(importlib.import_module(module), attribute)
    return found


def merge(blocks: dict[str, dict[str, dict[str, object]]]) -> dict[str, dict[str, object]]:
    """Totals over all blocks, per solver."""
    total: dict[str, dict[str, object]] = {}
    for name in next(iter(blocks.values()), {}):
        rows = [block[name] for block in blocks.values()]
        statuses: Counter[str] = sum((Counter(row["statuses"]) for row in rows), Counter())
        total[name] = {"problems": sum(statuses.values()), "statuses": dict(statuses)}
        for key in ("raised", "wrong"):
            total[name][key] = sum(row[key] for row in rows)
        for key in ("primal", "worst_kkt", "difference", "iterations", "max_us"):
            total[name][key] = max(row[key] for row in rows)
        for key in ("p50_us", "p99_us"):  # median over the blocks
            total[name][key] = float(np.median([row[key] for row in rows]))
    return total


def show(total: dict[str, dict[str, object]]) -> None:
    head = f"{'solver':16} {'problems':>9} {'p50':>8} {'p99':>8} {'max us':>9} {'iter':>5} "
    print(head + f"{'primal':>8} {'KKT':>8} {'x diff':>8} {'raised':>6} {'wrong':>5}  statuses")
    for name, row in total.items():
        counts = ", ".join(f"{key} {value}" for key, value in row["statuses"].items())
        print(
            f"{name:16} {row['problems']:9d} {row['p50_us']:8.1f} {row['p99_us']:8.1f} {row['max_us']:9.0f} "
            f"{row['iterations']:5d} {row['primal']:8.1e} {row['worst_kkt']:8.1e} {row['difference']:8.1e} "
            f"{row['raised']:6d} {row['wrong']:5d}  {counts}"
        )


def parse(arguments: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("family", help=f"{', '.join(FAMILIES)}, or module:callable")
    parser.add_argument("--count", type=int, default=10_000, help="problems in all")
    parser.add_argument("--block", type=int, default=500, help="problems per seed")
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--starts", type=Path, default=None, help="npy file, (m, nq) configurations")
    parser.add_argument(
        "--solvers", default="daqp,proxsuite", help="the first is what others are compared with"
    )
    parser.add_argument("--fixed-matrices", action="store_true")
    parser.add_argument("--cold", action="store_true", help="no warm start")
    parser.add_argument("--tolerance", type=float, default=SolverOptions().tolerance)
    parser.add_argument("--max-iterations", type=int, default=SolverOptions().max_iterations)
    parser.add_argument("--kkt-limit", type=float, default=1e-4)
    parser.add_argument("--difference-limit", type=float, default=1e-4)
    parser.add_argument("--keep", type=int, default=50, help="problems saved at most")
    parser.add_argument(
        "--out", type=Path, default=None, help="result file; default runs/qp_stress_FAMILY.json"
    )
    return parser.parse_args(arguments)


def main(arguments: list[str] | None = None) -> int:
    args = parse(arguments)
    options = SolverOptions(
        max_iterations=args.max_iterations, tolerance=args.tolerance,
        fixed_matrices=args.fixed_matrices, warm_start=not args.cold,
    )  # fmt: skip
    setup = Setup(
        family=f"{args.family} {args.starts or ''}".strip(),
        solvers=args.solvers.split(","),
        block=args.block,
        options=unusual(options),
    )
    out = args.out or Path("runs") / f"qp_stress_{args.family.rpartition(':')[0] or args.family}.json"
    out.parent.mkdir(parents=True, exist_ok=True)
    blocks = read_blocks(out, setup)
    bench = Bench(setup, options, (args.kkt_limit, args.difference_limit), out.with_suffix(""), args.keep)
    problems = find_family(args.family)
    if args.starts is not None:
        problems = functools.partial(problems, starts=np.load(args.starts))
    seeds = range(args.first_seed, args.first_seed + -(-args.count // args.block))
    start = written = time.monotonic()
    fresh = 0
    for seed in seeds:
        if str(seed) in blocks:
            continue
        tallies = bench.solve_block(problems, seed, args.block)
        blocks[str(seed)] = {name: tally.summary() for name, tally in tallies.items()}
        fresh += 1
        if time.monotonic() - written > WRITE_PERIOD:
            written = time.monotonic()
            write(out, {"setup": asdict(setup), "total": merge(blocks), "blocks": blocks})
            rate = fresh * args.block / (written - start)
            print(f"{len(blocks) * args.block} problems, {rate:.0f} a second", file=sys.stderr)
    total = merge(blocks)
    write(out, {"setup": asdict(setup), "total": total, "blocks": blocks})
    show(total)
    print(f"written to {out}")
    return 1 if any(row["raised"] or row["wrong"] for row in total.values()) else 0


def unusual(options: SolverOptions) -> dict[str, object]:
    """Options that are not the defaults: an option of a later version must not part old results from new."""
    usual = asdict(SolverOptions())
    return {key: value for key, value in asdict(options).items() if value != usual[key]}


def read_blocks(path: Path, setup: Setup) -> dict[str, dict[str, dict[str, object]]]:
    """Blocks of an earlier call, if it was of the same kind."""
    if not path.exists():
        return {}
    earlier = json.loads(path.read_text(encoding="utf-8"))
    if earlier["setup"] != asdict(setup):
        sys.exit(f"{path} holds results of another setup; give another --out or delete it")
    return dict(earlier["blocks"])


def write(path: Path, result: dict[str, object]) -> None:
    temporary = path.with_suffix(".tmp")
    temporary.write_text(json.dumps(result, indent=1), encoding="utf-8")
    temporary.replace(path)


if __name__ == "__main__":
    sys.exit(main())
