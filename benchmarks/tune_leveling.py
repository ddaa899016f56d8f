"""Search the gains of trunk levelling, with the same budget for every part.

    python benchmarks/tune_leveling.py --parts pd network persistence model \
        --cases 60,0.25 80,0.35 100,0.35 --trials 30 --storage runs/leveling.db

A case is ``mm/s,mix``; several are searched for one pair of gains that serves
the worst of them best (each against the same seeds without levelling), and
``--each`` searches every case on its own. Every part walks as long without
levelling before it acts, which is when the network learns. Robots are
randomised, seeds are 100 and up. ``--at 9000,100`` measures given gains instead
of searching; ``--set`` adds settings to every run, ``--with-set`` to those with
levelling. Run again with the same file, a search goes on.
"""

from __future__ import annotations

import argparse
import json
import statistics
from dataclasses import replace
from pathlib import Path

import optuna

from bluefoot_mpc.scenarios.options import CONTROLLERS
from bluefoot_mpc.tuning.cases import measure
from bluefoot_mpc.tuning.leveling import (
    OFF,
    PARTS,
    LevelCase,
    LevelJudge,
    level_cost,
    level_penalties,
    level_space,
)
from bluefoot_mpc.tuning.objective import Figures
from bluefoot_mpc.tuning.study import FIRST_SEED, StudyConfig, run_study

START = [{"tilt": 9000.0, "tilt_rate": 60.0}, {"tilt": 5000.0, "tilt_rate": 100.0}]
FIGURES = ("roll", "pitch", "height", "clearance", "speed_error", "torque", "joint_speed")


def told(name, figures, without):
    """One line of the table."""
    row = {key: statistics.median(getattr(f, key) for f in figures) for key in FIGURES}
    broken = {k: round(v, 3) for k, v in level_penalties(figures, without).items() if v > 0.0}
    cost = level_cost(figures, without)
    print(
        f"{name:44s} roll {row['roll']:.3f} pitch {row['pitch']:.3f} cost {cost:.3f} "
        f"height {row['height']:.1f} clear {row['clearance']:.1f} speed {row['speed_error']:+.1f}% "
        f"torque {row['torque']:.3f} joints {row['joint_speed']:.3f} {broken or ''}",
        flush=True,
    )
    return {**row, "cost": cost, "penalties": broken}


def parse_case(text, args):
    speed, mix = (float(part) for part in text.split(","))
    payload = tuple(float(part) for part in args.payload.split(",")) if args.payload else None
    case = LevelCase(
        speed=1e-3 * speed, mix=mix, controller=args.controller, payload=payload, randomize=args.randomize
    ).tuning_case()
    options = {**case.options, "overrides": (*case.options["overrides"], *args.set)}
    return replace(case, options=options)


def at(args, part, cases, without, seeds):
    """Figures of given gains."""
    space = level_space(part)
    rows = []
    for tilt, rate in args.at:
        overrides = (*space.overrides({"tilt": tilt, "tilt_rate": rate}), *args.with_set)
        for case in cases:
            runs = [measure(case, args.controller, overrides, seed) for seed in seeds]
            name = f"{case.name} {part} {tilt:g}/{rate:g}"
            rows.append({"name": name, **told(name, runs, without[case.name])})
    return rows


def search(args, part, cases, without, seeds):
    """The best gains of a part over a set of cases."""
    space = level_space(part)
    space = replace(space, fixed=(*space.fixed, *args.with_set))
    name = " | ".join([part, *(case.name for case in cases), *args.set, *args.with_set])
    rungs = (1, len(seeds)) if len(seeds) > 1 else (1,)
    config = StudyConfig(
        name=name, storage=args.storage, controller=args.controller, trials=args.trials,
        seeds=seeds, rungs=rungs, keep=0.5, startup=8,
    )  # fmt: skip
    result = run_study(config, space, cases, START, judge=LevelJudge(without=without))
    gains = f"{result.values['tilt']:.0f}/{result.values['tilt_rate']:.0f}"
    print(f"{name}: best {gains} cost {result.cost:.3f} after {result.trials} trials", flush=True)
    rows = []
    for case in cases:
        runs = [Figures(**result.figures[case.name][str(seed)]) for seed in seeds]
        line = f"{case.name} {part} {gains}"
        rows.append({"name": line, **told(line, runs, without[case.name])})
    return rows


def pair(text):
    tilt, rate = (float(part) for part in text.split(","))
    return tilt, rate


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--parts", nargs="+", choices=sorted(PARTS), default=["pd"])
    parser.add_argument("--controller", choices=CONTROLLERS, default="cpg")
    parser.add_argument("--cases", nargs="+", default=["60,0.25", "80,0.35", "100,0.35"], help="mm/s,mix")
    parser.add_argument("--payload", help="KG,X,Y,Z that the model does not know")
    parser.add_argument("--randomize", choices=("none", "standard"), default="standard")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED)
    parser.add_argument("--trials", type=int, default=30, help="budget of every search")
    parser.add_argument("--each", action="store_true", help="search every case on its own")
    parser.add_argument("--at", nargs="+", type=pair, help="TILT,RATE gains to measure instead")
    parser.add_argument("--set", action="append", default=[], help="setting for every run")
    parser.add_argument("--with-set", action="append", default=[], help="setting for runs with levelling")
    parser.add_argument("--storage", type=Path, default=Path("runs/leveling.db"))
    parser.add_argument("--json", type=Path, help="file for the figures")
    args = parser.parse_args()
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    cases = [parse_case(text, args) for text in args.cases]
    seeds = tuple(range(args.first_seed, args.first_seed + args.seeds))
    without, rows = {}, []
    for case in cases:
        without[case.name] = [measure(case, args.controller, OFF, seed) for seed in seeds]
        name = f"{case.name} off"
        rows.append({"name": name, **told(name, without[case.name], without[case.name])})
    for part in args.parts:
        for chosen in [[case] for case in cases] if args.each else [cases]:
            rows += (at if args.at else search)(args, part, chosen, without, seeds)
    if args.json:
        args.json.write_text(json.dumps(rows, indent=2), encoding="utf-8")


if __name__ == "__main__":
    main()
