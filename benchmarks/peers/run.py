"""Our stages beside other projects' for the same purpose, in one process, on the same instances.

    make peers                         installs the peers into .venv-peers and runs this
    make peers ARGS="--json --rounds 50"

The instances come from a trot and a slow walk of the simulated robot. Contestants
take turns, block by block; a ratio is the median over the blocks of ours over
theirs, so that both met the same load of the machine. Times are µs per call from
Python, setting of the references included. Exit status 1 where a bar is missed.

Whole body, on TSID's own tasks and constraints: ``TSID`` and ``PlaCo`` in C++,
``ours`` with a solver by name; ``solver always`` leaves out the look at the optimum
without limits, ``full problem`` has our own tasks and constraints. ``pushed``
instances have references so far off that limits bind.
Preview: see preview.py. Whole tick: whole body, preview and inverse kinematics.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from importlib.metadata import version
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import kinematics
import numpy as np
import preview
import whole_body
from recording import Recording, record
from rounds import Times, race, ratio

from bluefoot_mpc.model.legs import inverse
from bluefoot_mpc.zmp.preview import PreviewConfig, PreviewController

STANCES = {"4 feet": (True, True, True, True), "2 feet": (True, False, False, True)}
PUSHED = 8.0
"""Times the errors of quiet walking."""
SLOW_ROUNDS = 3
MOST_PREVIEWS = 150
"""Instances of the preview: the plain problem of one takes over a megabyte."""

Race = dict[str, Times]


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rounds", type=int, default=40, help="blocks of 20 calls that count")
    parser.add_argument("--seconds", type=float, default=10.0, help="length of each recorded walk")
    parser.add_argument("--json", action="store_true", help="print one JSON object instead of tables")
    parser.add_argument("--out", type=Path, help="write the JSON into this file as well")
    arguments = parser.parse_args()
    if arguments.rounds < 1 or not 1.0 <= arguments.seconds <= 120.0:
        parser.error("--rounds must be at least 1, --seconds within 1..120")
    with _quiet():
        result = measure(record(arguments.seconds), arguments.rounds)
    text = json.dumps(result, indent=2)
    if arguments.out is not None:
        arguments.out.write_text(text + "\n", encoding="utf-8")
    print(text) if arguments.json else show(result)
    return 0 if all(bar["holds"] for bar in result["bars"]) else 1


def measure(recording: Recording, rounds: int) -> dict:
    """Every race, and the bars."""
    races: dict[str, Race] = {}
    notes: dict[str, dict] = {}
    for stance, contact in STANCES.items():
        walked = [i for i in recording.whole_body if tuple(i.contact) == contact]
        for kind, size in (("", 1.0), (", pushed", PUSHED)):
            inputs = whole_body.with_errors(recording.robot, walked, size)
            name = f"whole body, {stance}{kind}"
            races[name] = race(whole_body.contestants(recording.robot, inputs), rounds)
            notes[name] = whole_body.agreement(recording.robot, inputs)
    config = PreviewConfig()
    walked = _thinned(preview.with_states(recording.preview, config))
    for kind, inputs in (("", walked), (", disturbed", preview.disturbed(walked))):
        peers = preview.Peers(config, inputs)
        races[f"preview{kind}"] = race(preview.contestants(inputs, peers, config), rounds)
        needed = {"ours_solver_needed": preview.solver_share(inputs, config)}
        notes[f"preview{kind}"] = needed | preview.unsolved(peers)
    races["inverse kinematics"] = race(kinematics.contestants(recording.robot, recording.feet), rounds)
    for stance in STANCES:
        races[f"whole tick, {stance}"] = race(ticks(recording, config, stance), rounds)
    found = bars(races)  # before the slow ones, which change no bar
    quiet = whole_body.with_errors(recording.robot, recording.standing_on(4))
    races["other solvers, whole body, 4 feet"] = race(
        whole_body.slow_contestants(recording.robot, quiet), SLOW_ROUNDS
    )
    races["other solvers, preview"] = race(
        preview.slow_contestants(preview.Peers(config, walked[::20])), SLOW_ROUNDS
    )
    return {
        "races": {name: _plain(entries) for name, entries in races.items()},
        "notes": notes, "bars": found, "versions": _versions(),
    }  # fmt: skip


def ticks(recording: Recording, config: PreviewConfig, stance: str) -> dict[str, object]:
    """Whole body, preview and inverse kinematics one after the other."""
    robot, contact = recording.robot, STANCES[stance]
    where = _thinned([k for k, i in enumerate(recording.whole_body) if tuple(i.contact) == contact])
    bodies = whole_body.with_errors(robot, [recording.whole_body[k] for k in where])
    plain = whole_body.without_extras(bodies)
    # The two recordings run tick by tick beside each other.
    ahead = preview.with_states(recording.preview, config)
    ahead = [ahead[min(k, len(ahead) - 1)] for k in where]
    feet = [recording.feet[min(k, len(recording.feet) - 1)] for k in where]
    ankles, count = kinematics.directions(robot, feet), len(where)
    peers, closed = preview.Peers(config, ahead), kinematics.NumpyIk(robot.geometry)
    chain = whole_body.Tsid(robot, np.array(contact))
    chain.prepare(plain)
    ours = {name: whole_body.Ours(robot, "daqp", full=name == "full") for name in ("plain", "full")}
    planner = PreviewController(config)

    def our_tick(k, body, inputs):
        ours[body](inputs[k % count])
        planner.step(ahead[k % count], preview.DT)
        return inverse(robot.geometry, feet[k % count], ankles[k % count])

    def chained(k, plan):
        chain(plain[k % count])
        plan(k % count)
        return closed(feet[k % count], ankles[k % count])

    return {
        "TSID + daqp preview, plain + numpy": lambda k: chained(k, lambda j: peers.plain[j].solve()),
        "TSID + daqp preview, hard + numpy": lambda k: chained(k, lambda j: peers.hard[j].solve()),
        "TSID + daqp preview, box + numpy": lambda k: chained(
            k, lambda j: [axis.solve() for axis in peers.box[j]]
        ),
        "ours, TSID's tasks": lambda k: our_tick(k, "plain", plain),
        "ours, full problem": lambda k: our_tick(k, "full", bodies),
    }


def bars(races: dict[str, Race]) -> list[dict]:
    """What was asked for, and what was reached."""
    asked = [
        ("whole body, 4 feet", "ours, proxsuite", "TSID", 1.0),
        ("whole body, 2 feet", "ours, proxsuite", "TSID", 1.3),
        ("whole body, 4 feet", "ours, daqp", "TSID", 0.35),
        ("whole body, 2 feet", "ours, daqp", "TSID", 0.55),
        *[("preview", "ours, whole step", f"daqp refactoring, {kind}", 0.7) for kind in ("plain", "hard")],
        *[
            (f"whole tick, {stance}", "ours, full problem", f"TSID + daqp preview, {kind} + numpy", 0.5)
            for kind in ("plain", "hard", "box")
            for stance in STANCES
        ],
    ]
    found = []
    for name, ours, theirs, most in asked:
        reached = ratio(races[name][ours], races[name][theirs])
        found.append(
            {"race": name, "ours": ours, "theirs": theirs, "most": most, "ratio": reached,
             "holds": reached <= most}
        )  # fmt: skip
    return found


def _thinned(instances: list) -> list:
    """At most `MOST_PREVIEWS` of them, spread evenly."""
    return instances[:: max(1, -(-len(instances) // MOST_PREVIEWS))]


def _plain(entries: Race) -> dict[str, dict[str, float]]:
    first = next(iter(entries.values()))
    return {name: {**times.as_plain(), "of_first": ratio(times, first)} for name, times in entries.items()}


def show(result: dict) -> None:
    for name, entries in result["races"].items():
        print(f"\n{name:48s} {'median':>9s} {'p99':>10s}  of the first")
        for contestant, times in entries.items():
            print(f"  {contestant:46s} {times['p50']:9.1f} {times['p99']:10.1f} {times['of_first']:8.3f}")
        if name in result["notes"]:
            print("  " + ", ".join(f"{key} {value:.3g}" for key, value in result["notes"][name].items()))
    print("\nbars")
    for bar in result["bars"]:
        verdict = "holds" if bar["holds"] else "MISSED"
        line = f"{bar['race']}: {bar['ours']} / {bar['theirs']}"
        print(f"  {line:84s} {bar['ratio']:6.2f} (<= {bar['most']:.2f}) {verdict}")


def _versions() -> dict[str, str]:
    names = ("pin", "tsid", "placo", "pin-pink", "mink", "proxsuite", "daqp", "casadi", "quadprog", "numpy")
    return {name: version(name) for name in names}


class _quiet:
    """Keep what libraries print in C off the standard output."""

    def __enter__(self):
        sys.stdout.flush()
        self._kept = os.dup(1)
        os.dup2(2, 1)

    def __exit__(self, *_):
        sys.stdout.flush()
        os.dup2(self._kept, 1)
        os.close(self._kept)


if __name__ == "__main__":
    sys.exit(main())
