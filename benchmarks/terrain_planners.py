"""What ways over rough ground cost, and how long it takes to find them: greedy windows against A*.

    OMP_NUM_THREADS=1 python benchmarks/terrain_planners.py [--seeds 10] [--worlds] [--json FILE]

The thesis' table: four starts by four windows, here on several grounds and over seeds, with A* beside it.
Every entry is the cost of the window's way over that of the cheapest way on the same graph, as the mean over
starts and seeds. Starts from which some window got stuck (no finite cell to step to) are left out of the
means of all windows and counted. The table comes twice: with windows that aim at the cheapest way, and with
such as aim at the cheapest cell, as in the thesis. `--worlds` adds true heights of the simulator's worlds.

Times are processor times of one thread, medians, taken in turns.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from pathlib import Path

import numpy as np

from bluefoot_mpc.sim.config import WorldConfig
from bluefoot_mpc.sim.worlds.heights import heights
from bluefoot_mpc.sim.worlds.make import world_plan
from bluefoot_mpc.terrain.comparison import GROUNDS, compare, made_ground, spread_starts
from bluefoot_mpc.terrain.cost import CostConfig, cost_tensor
from bluefoot_mpc.terrain.frame import centres
from bluefoot_mpc.terrain.graph import optimal
from bluefoot_mpc.terrain.lattice import Goal
from bluefoot_mpc.terrain.plan import PlanConfig, plan_route
from bluefoot_mpc.terrain.windows import WINDOWS, Aim, search
from bluefoot_mpc.types import HeightMap

WORLDS = ("world rubble", "world random_steps", "world kerb")
CELLS, CELL = 100, 0.02
EDGE = 12
"""Columns before the first and behind the last cell of a way, so that all feet stand on the map."""


def world_ground(name, seed):
    """The true heights of a world's rough part, as a map."""
    empty = np.full((CELLS, CELLS), np.nan)
    pose = np.array((0.0, -0.5 * CELLS * CELL, 0.0, 0.0))
    ground = HeightMap(time=0.0, cell=CELL, pose=pose, height=empty, confidence=np.ones_like(empty))
    plan = world_plan(WorldConfig(name=name.removeprefix("world "), layout_seed=seed), seed)
    return HeightMap(
        time=0.0, cell=CELL, pose=pose, height=heights(plan, centres(ground)), confidence=np.ones_like(empty)
    )


def table(make, names, seeds):
    """For each ground and rule: mean ratios, ways that got stuck, and the worst of A* over a window."""
    rows = {}
    for name in names:
        tensors = [cost_tensor(make(name, seed), CostConfig()) for seed in range(seeds)]
        for aim in Aim:
            found = [
                compare(cost, spread_starts(cost, EDGE, 18), Goal(CELLS - EDGE), aim=aim) for cost in tensors
            ]
            ratio = np.concatenate([part.ratio for part in found])
            ways = np.isfinite(np.concatenate([part.optimal for part in found]))
            # A world without anything costly on the way has no ratio that says anything.
            worth = np.concatenate([part.optimal for part in found]) > 1e-3
            all_there = np.isfinite(ratio).all(axis=1) & worth
            rows[name, str(aim)] = {
                "ratio": ratio[all_there].mean(axis=0).tolist() if all_there.any() else None,
                "starts": len(ratio),
                "counted": int(all_there.sum()),
                "no way": int((~ways).sum()),
                "stuck": (~np.isfinite(ratio[ways])).sum(axis=0).tolist(),
                "never below the optimum": bool((ratio[ways & worth] >= 1.0 - 1e-9).all()),
                "first": found[0].greedy.tolist(),
                "first optimal": found[0].optimal.tolist(),
            }
    return rows


def mean_of(rows, aim):
    """Mean over all starts of all grounds, by window."""
    parts = [row for (_, rule), row in rows.items() if rule == aim and row["ratio"] is not None]
    weights = np.array([row["counted"] for row in parts], dtype=float)
    return (weights @ np.array([row["ratio"] for row in parts]) / weights.sum()).tolist()


def timings(rounds):
    """ms, medians on 100 x 100 x 36 cells, in turns."""
    grounds = [made_ground("rubble", seed) for seed in range(4)]
    tensors = [cost_tensor(ground, CostConfig()) for ground in grounds]
    random = [np.random.default_rng(seed).random((CELLS, CELLS, 36)) for seed in range(2)]
    route = made_ground("rubble", 7, cells=80)
    route = HeightMap(time=0.0, cell=CELL, pose=np.array((-0.4, -0.8, 0.0, 0.0)), height=route.height,
                      confidence=route.confidence)  # fmt: skip
    calls = {
        "cost tensor": lambda k: cost_tensor(grounds[k % 4], CostConfig()),
        "A*": lambda k: optimal(tensors[k % 4], (50, EDGE, 18), Goal(CELLS - EDGE)),
        "A*, random costs": lambda k: optimal(random[k % 2], (50, 0, 18)),
        "route, 1.6 x 1.6 m": lambda k: plan_route(route, (0.0, 0.0, 0.1), (0.9, 0.0), PlanConfig()),
    }
    for window in WINDOWS:
        calls[f"window {window}"] = lambda k, window=window: search(
            tensors[k % 4], (50, EDGE, 18), Goal(CELLS - EDGE), window
        )
    times = {name: [] for name in calls}
    for turn in range(rounds + 1):
        for name, call in calls.items():
            begun = time.thread_time()
            call(turn)
            if turn:
                times[name].append(1e3 * (time.thread_time() - begun))
    return {name: {"median": float(np.median(t)), "worst": max(t)} for name, t in times.items()}


def show(result):
    for aim in Aim:
        print(f"\ncost of a window's way over the cheapest way's, windows aim at the cheapest {RULES[aim]}")
        print(
            f"{'ground':20s}" + "".join(f"{w:>8d}" for w in WINDOWS) + "    starts  no way  stuck, by window"
        )
        for name, rules in result["grounds"].items():
            row = rules[aim]
            ratio = "".join(f"{x:8.2f}" for x in row["ratio"]) if row["ratio"] else f"{'-':>32s}"
            print(f"{name:20s}{ratio}{row['counted']:10d}{row['no way']:8d}  {row['stuck']}")
        print(f"{'mean':20s}" + "".join(f"{x:8.2f}" for x in result["mean"][aim]))
    first, rules = next(iter(result["grounds"].items()))
    print(f"\ncosts on one map ({first}, seed 0), four starts by four windows, and A*")
    for costs, best in zip(rules[Aim.MEAN]["first"], rules[Aim.MEAN]["first optimal"], strict=True):
        print("  " + "".join(f"{x:9.3f}" for x in costs) + f"   A* {best:9.3f}")
    print("\nms on 100 x 100 x 36 cells" + f"{'median':>10s}{'worst':>10s}")
    for name, spent in result["ms"].items():
        print(f"{name:26s}{spent['median']:10.1f}{spent['worst']:10.1f}")


RULES = {Aim.MEAN: "way", Aim.CELL: "cell"}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--rounds", type=int, default=11, help="of timing")
    parser.add_argument("--worlds", action="store_true", help="true heights of the simulator's worlds, too")
    parser.add_argument("--json", type=Path, help="where to write all figures")
    options = parser.parse_args()
    if os.environ.get("OMP_NUM_THREADS") != "1":
        print("without OMP_NUM_THREADS=1 times are not those of one core")
    rows = table(made_ground, GROUNDS, options.seeds)
    if options.worlds:
        rows |= table(world_ground, WORLDS, options.seeds)
    names = dict.fromkeys(name for name, _ in rows)
    result = {
        "grounds": {name: {str(aim): rows[name, str(aim)] for aim in Aim} for name in names},
        "mean": {str(aim): mean_of(rows, str(aim)) for aim in Aim},
        "ms": timings(options.rounds),
    }
    show(result)
    if options.json:
        options.json.write_text(json.dumps(result, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
