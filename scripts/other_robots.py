"""Solo12, Go2 and ANYmal stand, squat and sway by BlueFoot's whole-body controller.

    python scripts/other_robots.py
    python scripts/other_robots.py anymal --duration 20 --solver proxsuite
    python scripts/other_robots.py --sway 0.2 --squat 0.15 --period 1.2 --limit 100
    python scripts/other_robots.py --push 0.3 --limit 100
    python scripts/other_robots.py --json --picture runs/other_robots.png

Their URDFs come from example-robot-data: pip install 'bluefoot-mpc[robots]'. The state is
the simulator's truth and torques act directly; BlueFoot's estimator, servos and bus take no
part. What is shown is that model and whole-body controller are made for no particular robot.
Exit status 1 if a robot falls or its centre of mass strays by more than --limit.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from rich.console import Console
from rich.table import Table

from bluefoot_mpc.exceptions import BlueFootError
from bluefoot_mpc.model.library import LIBRARY, load_library_robot
from bluefoot_mpc.model.parameters import GRAVITY
from bluefoot_mpc.scenarios.torque_robots import PHASES, BalanceConfig, BalanceRun, run_balance
from bluefoot_mpc.viz.style import COM, COMMAND, ESTIMATE, GOOD, TRUTH, figure_style
from bluefoot_mpc.wbc import WholeBodyConfig

_MM = 1e3

COLUMNS = {
    "robot": "robot",
    "mass": "mass\nkg",
    "fell": "fell",
    "squat": "squat\n± mm",
    "sway": "sway\n± mm",
    "error_rms": "COM error\nRMS mm",
    "error_max": "COM error\nmax mm",
    "tilt_max": "tilt\nmax °",
    "force_min": "foot force\nmin N",
    "force_max": "foot force\nmax N",
    "torque_max": "torque\nmax N·m",
    "solved": "optimum\n% ticks",
    "limited": "limits\nmet %",
    "tick_median": "tick\np50 µs",
    "tick_p99": "tick\np99 µs",
}
_DIGITS = {"error_rms": 2, "error_max": 2, "tilt_max": 3, "torque_max": 2}


def main() -> int:
    """Run the robots asked for, print what happened."""
    arguments = _arguments()
    try:
        body = WholeBodyConfig(solver=arguments.solver, free_first=not arguments.always_solve)
        motion = {name: getattr(arguments, name) for name in ("duration", "squat", "sway", "period", "push")}
        config = BalanceConfig(body=body, **motion)
        runs = [run_balance(load_library_robot(name), config) for name in arguments.robots or LIBRARY]
    except BlueFootError as error:
        print(f"error: {error}", file=sys.stderr)
        return error.exit_status
    rows = [figures(run) for run in runs]
    if arguments.json:
        print(json.dumps({"duration": config.duration, "solver": body.solver, "robots": rows}, indent=2))
    else:
        _print(rows, config)
    if arguments.picture:
        draw(runs, arguments.picture)
        print(f"wrote {arguments.picture}", file=sys.stderr)
    return int(any(row["fell"] or not row["error_max"] <= arguments.limit for row in rows))


def figures(run: BalanceRun) -> dict[str, Any]:
    """What the table shows of a run, and the errors of each phase; mm, degrees, N, N·m, µs."""
    config, normal, error = run.config, run.force[:, :, 2], _MM * run.error()
    by_phase = {name: _MM * run.error(name) for name in PHASES}
    return {
        "robot": run.robot,
        "mass": run.mass,
        "fell": run.fell,
        "squat": _MM * config.squat * run.wanted[0, 2],
        "sway": _MM * config.sway * run.wanted[0, 2],
        "error_rms": _rms(error),
        "error_max": float(error.max()),
        "error_by_phase": {k: {"rms": _rms(e), "max": float(e.max())} for k, e in by_phase.items() if e.size},
        "tilt_max": float(np.degrees(run.tilt.max())),
        "force_min": float(normal.min()),
        "force_max": float(normal.max()),
        "torque_max": float(np.abs(run.torque).max()),
        "travel_max": float(_MM * run.travel.max()),
        "solved": 100.0 * float(run.solved.mean()),
        # Where the optimum without limits keeps them all, the solver is not asked.
        "limited": 100.0 * float((run.iterations > 0).mean()),
        "tick_median": float(1e6 * np.median(run.tick)),
        "tick_p99": float(1e6 * np.percentile(run.tick, 99)),
    }


def draw(runs: list[BalanceRun], path: Path) -> None:
    """A picture: the centre of mass of each robot with its reference, and the distance between them."""
    with figure_style():
        figure = Figure(figsize=(3.6 * len(runs), 6.4))
        grid = figure.subplots(3, len(runs), sharex=True, sharey="row", squeeze=False)
        for column, run in zip(grid.T, runs, strict=True):
            moved, wanted = _MM * (run.com - run.com[0]), _MM * (run.wanted - run.wanted[0])
            for axis, colour in enumerate((ESTIMATE, GOOD, COM)):
                column[0].plot(run.time, moved[:, axis], color=colour, label=f"COM {'xyz'[axis]}")
            column[0].plot(run.time, wanted, color=COMMAND, linestyle=":", label=["wanted", None, None])
            column[1].plot(run.time, _MM * run.error(), color=TRUTH)
            column[2].plot(run.time, run.force[:, :, 2] / (run.mass * GRAVITY), linewidth=0.8)
            column[0].set_title(f"{run.robot}, {run.mass:.1f} kg")
            column[2].set_xlabel("time, s")
        for row, label in zip(
            grid[:, 0], ("COM moved, mm", "COM error, mm", "foot force / weight"), strict=True
        ):
            row.set_ylabel(label)
        grid[0, 0].legend(loc="upper left", ncols=2)
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path)


def _rms(values: Any) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _print(rows: list[dict[str, Any]], config: BalanceConfig) -> None:
    rate = 1.0 / config.control_period
    table = Table(title=f"Whole-body control of other robots: {config.duration:g} s at {rate:g} Hz")
    for key, title in COLUMNS.items():
        table.add_column(title, justify="left" if key == "robot" else "right")
    for row in rows:
        table.add_row(*[_cell(key, row[key]) for key in COLUMNS])
    Console(width=max(Console().width, 150)).print(table)


def _cell(key: str, value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return value if isinstance(value, str) else f"{value:.{_DIGITS.get(key, 1)}f}"


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("robots", nargs="*", help=f"by default all: {', '.join(LIBRARY)}")
    defaults = BalanceConfig()
    for name, what in (
        ("duration", "s, all phases"),
        ("squat", "up and down, of the height of the centre of mass"),
        ("sway", "radius of the circle, of that height"),
        ("period", "s of a squat and of a circle"),
        ("push", "N·s per kg on the trunk to the left, while it stands"),
    ):
        parser.add_argument(f"--{name}", type=float, default=getattr(defaults, name), help=what)
    parser.add_argument("--solver", default=WholeBodyConfig().solver, help="backend of the whole-body QP")
    parser.add_argument(
        "--always-solve", action="store_true", help="by the solver, even where the optimum keeps all limits"
    )
    parser.add_argument("--limit", type=float, default=3.0, help="mm that the centre of mass may stray")
    parser.add_argument("--json", action="store_true", help="print JSON instead of a table")
    parser.add_argument("--picture", type=Path, help="also write a plot, PNG or SVG")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
