"""The walk of the issue's scenario in simulation and on the emulated robot, side by side.

    python benchmarks/emulator_walk.py [--seeds 5] [--duration 60] [--pty]

The emulated robot walks in process on a virtual clock; with ``--pty`` also in
real time over pseudo-terminals (a second of it takes a second). Prints a table
and writes ``runs/emulator_walk.json``.
"""

from __future__ import annotations

import argparse
import json
import statistics
from pathlib import Path
from typing import Any

from bluefoot_mpc.scenarios import RunOptions
from bluefoot_mpc.scenarios.runner import simulate

KEYS = ("fell", "stop_reason", "roll_rms_deg", "pitch_rms_deg", "speed_mps", "attitude_error_rms_deg")


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--duration", type=float, default=60.0)
    parser.add_argument("--speed", type=float, default=0.06)
    parser.add_argument("--randomize", default="standard")
    parser.add_argument("--pty", action="store_true", help="in real time as well")
    parser.add_argument("--out", type=Path, default=Path("runs/emulator_walk.json"))
    given = parser.parse_args()
    robots = [("sim", None), ("emulator", "memory")] + ([("emulator", "pty")] if given.pty else [])
    results: dict[str, list[dict[str, Any]]] = {}
    for robot, link in robots:
        name = robot if link is None else f"{robot} {link}"
        results[name] = [_run(given, robot, link, seed) for seed in range(given.seeds)]
        _print(name, results[name])
    given.out.parent.mkdir(parents=True, exist_ok=True)
    given.out.write_text(json.dumps(results, indent=2) + "\n", encoding="utf-8")
    for axis in ("roll_rms_deg", "pitch_rms_deg"):
        base = _median(results["sim"], axis)
        for name in list(results)[1:]:
            print(
                f"{name}: {axis} median {_median(results[name], axis):.3f}, "
                f"sim {base:.3f}, limit {base + 0.1:.3f}"
            )


def _run(given: argparse.Namespace, robot: str, link: str | None, seed: int) -> dict[str, Any]:
    options = RunOptions(
        robot=robot, link=link, controller="mpc", duration=given.duration, speed=given.speed, seed=seed,
        randomize=given.randomize,
    )  # fmt: skip
    result = simulate("walk", options)
    seen = {key: result.summary[key] for key in KEYS}
    seen["devices"] = result.summary["figures"].get("devices")
    seen["tick_us"] = result.summary["tick_us"]
    seen["deadline_misses"] = result.summary["deadline_misses"]
    seen["real_time_factor"] = result.summary["real_time_factor"]
    return seen


def _median(runs: list[dict[str, Any]], key: str) -> float:
    return statistics.median(run[key] for run in runs)


def _print(name: str, runs: list[dict[str, Any]]) -> None:
    print(f"\n{name}")
    for seed, run in enumerate(runs):
        print(
            f"  seed {seed}: fell {run['fell']},"
            f" roll/pitch {run['roll_rms_deg']:.3f}/{run['pitch_rms_deg']:.3f} deg,"
            f" {1e3 * run['speed_mps']:.1f} mm/s, estimate {run['attitude_error_rms_deg']:.3f} deg,"
            f" {run['stop_reason']}, devices {run['devices']}",
            flush=True,
        )


if __name__ == "__main__":
    main()
