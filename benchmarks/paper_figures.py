"""Draw the paper's gait figures, and say how they compare with what it shows.

    python benchmarks/paper_figures.py [--out runs/paper] [--seed 0]

CPG time series and phase portraits of both gaits and of the transition, the
footfall pattern at 40 mm/s, and the trunk's motion under the ZMP law in a walk.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

os.environ.setdefault("OMP_NUM_THREADS", "1")

from bluefoot_mpc.model.robot import load_robot
from bluefoot_mpc.scenarios import RunOptions
from bluefoot_mpc.scenarios.runner import simulate
from bluefoot_mpc.viz.figures import write_figures, write_trunk_figure

SPEED = 0.04  # m/s, of the paper's footfall figure


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("runs/paper"))
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    robot = load_robot()
    files = write_figures(robot, options.out)
    table = Table(
        "gait", "lift-off lags FL FR RL RR", "footfall order", "duty factor", "cycle s", "trunk sway mm"
    )
    for gait in ("trot", "walk"):
        run = RunOptions(gait=gait, speed=SPEED, duration=20.0, seed=options.seed)
        result = simulate("walk", run)
        figures = result.summary["figures"]
        lags = "  ".join(f"{lag % 1.0:.2f}" for lag in figures["lift_off_lags"])
        sway = 1e3 * np.ptp(result.data.stack("telemetry", "reference.trunk_position")[250:, 1])
        table.add_row(
            gait, lags, figures["footfall_order"], f"{figures['duty_factor']:.2f}",
            f"{figures['cycle_s']:.2f}", f"{sway:.0f}",
        )  # fmt: skip
        if gait == "walk":
            files += write_trunk_figure(result.data, robot, options.out, start=10.0, duration=6.0)
    console = Console()
    console.print(table)
    console.print(
        "Expected of the paper's networks: a trot lifts FL+RR and FR+RL half a cycle apart;"
        " a walk puts its feet down FR, RL, FL, RR; the trunk sways away from the leg in flight,"
        " and not at all in a trot."
    )
    for file in files:
        console.print(f"wrote {file}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
