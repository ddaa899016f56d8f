"""Search the gait's parameters speed by speed and join them to one table.

    python benchmarks/tune_gait.py --gait trot --speeds 60 100 200 300 400 --trials 60 \
        --storage runs/tuning.db --out runs/trot.toml

Every speed has a study of its own on one SQLite file; run again with the same
file, the search goes on until each has its budget. Robots are randomised, seeds
are 100 and up (reported figures use seeds below). The table is written as the
part of a configuration that ``--config`` takes. Two controllers searched with
the same ``--trials`` compare fairly; ``--plain`` leaves out what the paper's
laws do not have.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import optuna

from bluefoot_mpc.gait.table import NAMES
from bluefoot_mpc.scenarios.options import CONTROLLERS
from bluefoot_mpc.settings import dump_toml, parse_override
from bluefoot_mpc.tuning.cases import walking_case
from bluefoot_mpc.tuning.path import Candidate, gait_table, smooth_path
from bluefoot_mpc.tuning.space import SPACES, Space
from bluefoot_mpc.tuning.study import StudyConfig, candidates, run_study


def study_config(speed: int, args: argparse.Namespace) -> StudyConfig:
    name = f"{args.controller} {args.gait} {speed} mm/s"
    return StudyConfig(name=name, storage=args.storage, controller=args.controller, trials=args.trials)


def search(args: argparse.Namespace, space: Space) -> dict[float, list[Candidate]]:
    """The best points of every speed; each search starts from the best of the speed before."""
    found: dict[float, list[Candidate]] = {}
    start: list[dict[str, float]] = []
    for speed in sorted(args.speeds):
        config = study_config(speed, args)
        result = run_study(config, space, [walking_case(args.gait, 1e-3 * speed)], start)
        print(f"{config.name}: cost {result.cost:.3f} after {result.trials} trials")
        found[1e-3 * speed] = candidates(config, space, args.keep)
        start = [candidate.values for candidate in found[1e-3 * speed][:3]]
    return found


def last_level(override: str) -> list[tuple[str, Any]]:
    """Keys and values of an override's innermost table."""
    table: Any = parse_override(override)
    while all(isinstance(value, dict) for value in table.values()):
        (table,) = table.values()
    return list(table.items())


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--gait", choices=sorted(SPACES), default="trot")
    parser.add_argument("--controller", choices=CONTROLLERS, default="mpc")
    parser.add_argument("--speeds", type=int, nargs="+", default=[60, 100, 200, 300, 400], help="mm/s")
    parser.add_argument("--trials", type=int, default=60, help="budget of every speed")
    parser.add_argument("--keep", type=int, default=12, help="points of a speed that may enter the table")
    parser.add_argument("--smoothness", type=float, default=0.3, help="cost of a rough table")
    parser.add_argument("--plain", action="store_true", help="no levelling gain and feed-forward")
    parser.add_argument("--storage", type=Path, default=Path("runs/tuning.db"))
    parser.add_argument("--out", type=Path, default=Path("runs/gait_table.toml"))
    args = parser.parse_args()
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    space = SPACES[args.gait](feed_forward=not args.plain)
    path = smooth_path(search(args, space), space, args.smoothness)
    knots = {speed: candidate.values for speed, candidate in path.items()}
    # The names of the swing law hold at every knot.
    words = {key: value for text in space.fixed for key, value in last_level(text) if key in NAMES}
    columns = {**gait_table(knots), **words}
    table = {"control": {"gait": {f"{args.gait}_table": columns}}}
    args.out.parent.mkdir(parents=True, exist_ok=True)
    args.out.write_text(dump_toml(table), encoding="utf-8")
    print(f"wrote {args.out}")


if __name__ == "__main__":
    main()
