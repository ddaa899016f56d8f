"""Time of one tick of the whole levelling law, source by source, on the inputs of a recorded walk.

    OMP_NUM_THREADS=1 python benchmarks/level_timing.py [--rounds 5] [--json]

The scenario ``level`` is walked once; what its ticks gave to the levelling stage
is then given to stages of every source of the disturbance and both mass
matrices, in one process and in turns, so that all meet the same load of the
machine. The network learns on every tick, which is the longest it can take.
Its training and prediction alone: ``benchmarks/narx_timing.py``.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import replace

import numpy as np

from bluefoot_mpc.control.leveling import LevelStage
from bluefoot_mpc.model.robot import load_robot
from bluefoot_mpc.scenarios import RunOptions
from bluefoot_mpc.scenarios.runner import simulate

BUDGET, TAIL_BUDGET = 400.0, 1000.0
"""µs that the median and the 99th percentile may take."""
BLOCK = 50
"""Ticks that one variant runs before the next takes its turn."""
WARM_UP = 200
"""Ticks that are not counted."""


def recorded(duration):
    """Arguments of the levelling stage: what it was made from, and what every tick gave it."""
    made, ticks = [], []
    plain_init, plain_step = LevelStage.__init__, LevelStage.step

    def init(stage, robot, config, gait_joints):
        made.append((config, gait_joints))
        plain_init(stage, robot, config, gait_joints)

    def step(stage, *arguments):
        ticks.append(arguments)
        return plain_step(stage, *arguments)

    LevelStage.__init__, LevelStage.step = init, step
    try:
        simulate("level", RunOptions(duration=duration))
    finally:
        LevelStage.__init__, LevelStage.step = plain_init, plain_step
    return *made[0], ticks


def measure(rounds, duration):
    """Median, p99 and longest tick of every variant, µs."""
    config, gait_joints, ticks = recorded(duration)
    schedule = replace(config.schedule, learn="always")
    stages = {
        f"{psi}, {matrix} mass matrix": LevelStage(
            load_robot(), replace(config, psi=psi, mass_matrix=matrix, schedule=schedule), gait_joints
        )
        for psi in ("zero", "persistence", "model", "network")
        for matrix in ("nominal", "model")
    }
    times = {name: [] for name in stages}
    for _ in range(rounds):
        for first in range(0, len(ticks), BLOCK):
            for name, stage in stages.items():
                for arguments in ticks[first : first + BLOCK]:
                    begin = time.perf_counter()
                    stage.step(*arguments)
                    times[name].append(1e6 * (time.perf_counter() - begin))
    return {name: summary(np.array(values[WARM_UP:])) for name, values in times.items()}


def summary(values):
    return {
        "median_us": float(np.median(values)),
        "p99_us": float(np.percentile(values, 99)),
        "max_us": float(values.max()),
    }


def show(rows):
    print(f"{'µs':32s} {'median':>8s} {'p99':>8s} {'max':>9s}")
    for name, row in rows.items():
        over = row["median_us"] > BUDGET or row["p99_us"] > TAIL_BUDGET
        print(
            f"{name:32s} {row['median_us']:8.1f} {row['p99_us']:8.1f} {row['max_us']:9.1f}"
            + ("  over budget" if over else "")
        )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=5, help="times the walk is gone through")
    parser.add_argument("--duration", type=float, default=34.0, help="s of the walk")
    parser.add_argument("--json", action="store_true", help="print JSON instead of a table")
    arguments = parser.parse_args()
    rows = measure(arguments.rounds, arguments.duration)
    if arguments.json:
        print(json.dumps({"budget_us": BUDGET, "p99_budget_us": TAIL_BUDGET, "variants": rows}, indent=2))
    else:
        show(rows)


if __name__ == "__main__":
    main()
