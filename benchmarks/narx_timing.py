"""Time of one tick of the NARX network, training and prediction, at the robot's size.

    OMP_NUM_THREADS=1 python benchmarks/narx_timing.py [--ticks 20000] [--json]

56 inputs and 22 outputs (the paper's z1, z2, contact forces and ψ), one to four
delays, both feedbacks, in one process. The variants take turns in blocks, so
that all of them meet the same load of the machine. A tick is what a control
tick calls: `train` with the target of the prediction before, then `predict`.
The signals are a noisy periodic motion of size one.
"""

from __future__ import annotations

import argparse
import json
import time

import numpy as np

from bluefoot_mpc.leveling.narx import Narx, NarxConfig

INPUTS, OUTPUTS = 56, 22
DELAYS = (1, 2, 3, 4)
BUDGET = 150.0
"""µs that the median of a tick may take."""
BLOCK = 250
WARM_UP = 2
"""Blocks that are not counted."""


def signals(ticks, rng):
    """(ticks, 56) inputs and (ticks, 22) targets, periodic in 25 ticks, with noise."""
    turn = 2.0 * np.pi * np.arange(ticks)[:, None] / 25.0
    inputs = np.sin(turn + rng.uniform(0.0, 6.0, INPUTS)) + 0.1 * rng.normal(size=(ticks, INPUTS))
    targets = np.sin(turn + rng.uniform(0.0, 6.0, OUTPUTS)) + 0.1 * rng.normal(size=(ticks, OUTPUTS))
    return inputs, targets


class Variant:
    """One network and the times of its calls."""

    def __init__(self, delays, feedback, ticks):
        config = NarxConfig(delays=delays, feedback=feedback)
        self.network = Narx(config, np.ones(INPUTS), np.ones(OUTPUTS))
        self.times = np.zeros((ticks, 2))

    def run(self, first, inputs, targets):
        network, clock = self.network, time.perf_counter
        for tick in range(first, first + len(inputs)):
            target, given = targets[tick - first], inputs[tick - first]
            begin = clock()
            network.train(target)
            middle = clock()
            network.predict(given)
            self.times[tick] = middle - begin, clock() - middle

    def summary(self):
        counted = 1e6 * self.times[WARM_UP * BLOCK :]
        whole = counted.sum(axis=1)
        return {
            "train_median_us": float(np.median(counted[:, 0])),
            "predict_median_us": float(np.median(counted[:, 1])),
            "tick_median_us": float(np.median(whole)),
            "tick_p99_us": float(np.percentile(whole, 99)),
            "tick_max_us": float(whole.max()),
            "diverged": self.network.diverged,
        }


def measure(ticks, rng):
    """Summaries by name of every variant."""
    blocks = WARM_UP + max(1, ticks // BLOCK)
    inputs, targets = signals(blocks * BLOCK, rng)
    variants = {
        f"{delays} delays, {feedback} fed back": Variant(delays, feedback, blocks * BLOCK)
        for delays in DELAYS
        for feedback in ("output", "target")
    }
    for first in range(0, blocks * BLOCK, BLOCK):
        part = slice(first, first + BLOCK)
        for variant in variants.values():
            variant.run(first, inputs[part], targets[part])
    return {name: variant.summary() for name, variant in variants.items()}


def show(rows):
    print(f"{'µs':28s} {'train':>8s} {'predict':>8s} {'tick':>8s} {'p99':>8s} {'max':>9s}")
    for name, row in rows.items():
        figures = [row[key] for key in ("train_median_us", "predict_median_us", "tick_median_us")]
        print(
            f"{name:28s}"
            + "".join(f" {value:8.1f}" for value in (*figures, row["tick_p99_us"]))
            + f" {row['tick_max_us']:9.1f}"
            + ("  over budget" if row["tick_median_us"] > BUDGET else "")
            + ("  diverged" if row["diverged"] else "")
        )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--ticks", type=int, default=20_000, help="ticks per variant")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--json", action="store_true", help="print JSON instead of a table")
    arguments = parser.parse_args()
    rows = measure(arguments.ticks, np.random.default_rng(arguments.seed))
    if arguments.json:
        print(json.dumps({"budget_us": BUDGET, "variants": rows}, indent=2))
    else:
        show(rows)


if __name__ == "__main__":
    main()
