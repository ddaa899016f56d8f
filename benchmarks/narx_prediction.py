"""What the levelling network predicts, one command period ahead, against simpler predictors.

    OMP_NUM_THREADS=1 python benchmarks/narx_prediction.py [--speed 60] [--seconds 40] [--seeds 3] [--json]

Robots walk without levelling and are recorded; the levelling law's signals are
made of what the controller knew: inputs u_k and target ψ_k (all that is not
motor torque). At u_k and ψ_k every predictor says ψ_{k+1}; its error RMS over a
stretch of the run is divided by the signal's RMS over the same stretch, so 1 is
as good as saying zero. Groups: force and moment on the trunk, torques on the
joints, and `turn` = roll and pitch of Γ1 M̂⁻¹ ψ, which alone the law uses.
`turn*` compares with ψ made of the simulator's true velocities and mean motor
torques instead of with the estimated target. Figures are medians over seeds;
robots are randomised. Another table says how fast the networks learn, the last
one how good the target itself is. With ``--levelling`` the attitude part levels
from 10 to 20 s, 30 to 40 s and so on, as in the paper's windows: rows `off
windows` then show a network that learns in the off windows, and is used in the
on windows, where the robot moves in another way.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import replace

import numpy as np
from narx_signals import CYCLE, DELAYS, LOAD, record

from bluefoot_mpc.leveling.narx import Narx, NarxConfig
from bluefoot_mpc.leveling.signals import INPUT_SCALE, OUTPUT_SCALE

GROUPS = ("force", "moment", "joints", "turn", "turn*")
STRETCHES = ((1.0, 6.0), (10.0, 20.0), (30.0, 40.0))
"""s of walking over which errors are taken."""
WINDOW = 500
"""Ticks of an off or an on window."""


def network(recording, config, in_windows=False):
    """(n, 22) predictions by a network that learns on line, always or in the off windows; NaN if diverged."""
    target = recording.target
    narx = Narx(config, INPUT_SCALE, OUTPUT_SCALE)
    found = np.full_like(target, np.nan)
    for tick in range(len(target) - 1):
        narx.train(target[tick], learn=not in_windows or tick // WINDOW % 2 == 0)
        prediction = narx.predict(recording.inputs[tick])
        if prediction.valid:
            found[tick + 1] = prediction.value
    return found


def simple(recording):
    """(n, 22) predictions by name, none of which learns more than a mean."""
    target = recording.target
    count = np.arange(1, len(target))[:, None]
    found = {}
    for name, lag in (("persistence", 1), ("cycle ago", CYCLE)):
        found[name] = np.full_like(target, np.nan)
        found[name][lag:] = target[:-lag]
    found["mean so far"] = np.vstack([np.full((1, 22), np.nan), np.cumsum(target[:-1], axis=0) / count])
    found["model"] = np.vstack([np.full((1, 22), np.nan), recording.model[:-1]])
    found["mean of 5 cycles"] = np.full_like(target, np.nan)
    reach = 5 * CYCLE
    past = [target[reach - turns * CYCLE : len(target) - turns * CYCLE] for turns in range(1, 6)]
    found["mean of 5 cycles"][reach:] = np.mean(past, axis=0)
    return found


def linear(recording, ticks, delays, ridge=1.0):
    """(n, 22) predictions by a linear law of the network's inputs, fitted to the first ticks."""
    target = recording.target / OUTPUT_SCALE
    inputs = recording.inputs / INPUT_SCALE
    rows = np.hstack(
        [np.ones((len(target), 1))]
        + [np.roll(signal, lag, axis=0) for lag in range(delays) for signal in (inputs, target)]
    )
    fitted = slice(delays, ticks - 1)
    a, b = rows[fitted], target[delays + 1 : ticks]
    weights = np.linalg.solve(a.T @ a + ridge * np.eye(a.shape[1]), a.T @ b)
    found = np.full_like(target, np.nan)
    found[1:] = (rows @ weights)[:-1] * OUTPUT_SCALE
    return found


def groups(values, turn):
    """Components by group."""
    parts = {"force": values[:, :3], "moment": values[:, 3:6], "joints": values[:, 6:]}
    return {**parts, "turn": values @ turn.T}


def rms(values):
    return float(np.sqrt(np.mean(values**2)))


def errors(recording, predicted, span):
    """Error RMS over signal RMS by group, over the ticks of a stretch."""
    error = groups((predicted - recording.target)[span], recording.turn)
    signal = groups(recording.target[span], recording.turn)
    found = {name: rms(error[name]) / rms(signal[name]) for name in error}
    true = recording.true[span] @ recording.turn.T
    found["turn*"] = rms(predicted[span] @ recording.turn.T - true) / rms(true)
    return found


CURVE = ((1, 1), (2, 2), (4, 2), (6, 4), (10, 10), (20, 20), (40, 20), (60, 60), (120, 120))
"""s of walking at which a stretch begins, and its length."""


def variants(names):
    """Networks to compare: the shipped one, and changes to it."""
    base = NarxConfig()
    found = {"network": base}
    if names == "shipped":
        return found
    for delays in (1, 2, 3, 4):
        for feedback in ("output", "target"):
            found[f"net n={delays} {feedback}"] = replace(base, delays=delays, feedback=feedback)
    two = replace(base, delays=2, feedback="target", rate_max=0.3)
    for rate in (0.001, 0.003, 0.01, 0.02, 0.03, 0.1):
        found[f"net n=2 target rate {rate:g}"] = replace(two, rate=rate, beta=0.0)
    for beta, zeta in ((1e-3, 0.5), (1e-3, 1.0), (1e-3, 1.5), (1e-2, 1.0)):
        changes = {"rate": 0.02, "rate_max": 0.03, "beta": beta, "zeta": zeta}
        found[f"net n=2 target beta {beta:g} zeta {zeta:g}"] = replace(two, **changes)
    return found


def stretches(seconds):
    """(name, ticks) of the stretches that fit."""
    for start, end in STRETCHES:
        if end <= seconds:
            yield f"{start:g}-{end:g} s", slice(round(start / 0.02), round(end / 0.02))


def predictions(recording, args):
    """Predictions by name."""
    found = dict(simple(recording))
    for delays in (1, 2):
        found[f"linear n={delays}, fitted to 10 s"] = linear(recording, round(10.0 / 0.02), delays)
    for name, config in variants(args.networks).items():
        found[name] = network(recording, config)
        found[f"{name}, off windows"] = network(recording, config, in_windows=True)
    return found


def curves(recording, predicted, seconds):
    """`turn` error by name and seconds of walking, of what learns and of what it competes with."""
    names = [name for name in predicted if name.startswith("net") and "windows" not in name]
    found = {}
    for name in ("persistence", "mean so far", "cycle ago", *names):
        found[name] = {}
        for start, step in CURVE:
            if start + step <= seconds:
                span = slice(50 * start, 50 * (start + step))
                found[name][f"{start}-{start + step}"] = errors(recording, predicted[name], span)["turn"]
    return found


def target_quality(recording, span):
    """How far the estimated target is from the true one: error RMS over true RMS, and correlation."""
    true = groups(recording.true[span], recording.turn)
    kinds = dict(recording.targets)
    kinds |= {f"true {name}": values for name, values in recording.mixed.items()}
    found = {}
    for name, values in kinds.items():
        parts = groups(values[span], recording.turn)
        row = {group: rms(parts[group] - true[group]) / rms(true[group]) for group in parts}
        row["turn corr"] = float(np.corrcoef(parts["turn"].ravel(), true["turn"].ravel())[0, 1])
        found[name] = row
    found["RMS of the true one"] = {group: rms(values) for group, values in true.items()}
    found["RMS of the estimated one"] = {
        group: rms(values) for group, values in groups(recording.target[span], recording.turn).items()
    }
    return found


def medians(tables):
    """Medians over seeds of nested tables of numbers."""
    first = tables[0]
    if isinstance(first, dict):
        return {key: medians([table[key] for table in tables]) for key in first}
    return float(np.median(tables))


def show(title, rows, columns):
    print(f"\n{title}\n{'':44s}" + "".join(f"{column:>10s}" for column in columns))
    for name, row in rows.items():
        print(f"{name:44s}" + "".join(f"{row.get(column, float('nan')):10.3f}" for column in columns))


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--speed", type=float, default=60.0, help="mm/s")
    parser.add_argument("--seconds", type=float, default=40.0, help="of walking")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--first-seed", type=int, default=100)
    parser.add_argument("--randomize", choices=("none", "standard"), default="standard")
    parser.add_argument("--target", choices=(LOAD, *DELAYS), default=LOAD, help="source of torques")
    parser.add_argument("--networks", choices=("shipped", "all"), default="all")
    parser.add_argument("--levelling", action="store_true", help="the attitude part acts in windows")
    parser.add_argument("--set", action="append", default=[], help="setting of the run")
    parser.add_argument("--json", action="store_true", help="print JSON instead of tables")
    args = parser.parse_args()
    tables = []
    for seed in range(args.first_seed, args.first_seed + args.seeds):
        recording = record(args, seed)
        predicted = predictions(recording, args)
        spans = dict(stretches(args.seconds))
        table = {
            span: {name: errors(recording, values, ticks) for name, values in predicted.items()}
            for span, ticks in spans.items()
        }
        last = list(spans.values())[-1]
        learning = curves(recording, predicted, args.seconds)
        tables.append({"errors": table, "learning": learning, "target": target_quality(recording, last)})
    result = medians(tables)
    if args.json:
        print(json.dumps(result, indent=2))
        return
    for span, rows in result["errors"].items():
        show(f"error / signal, {span} of walking", rows, GROUPS)
    learning = result["learning"]
    show("turn: error / signal by seconds of walking", learning, learning["persistence"])
    show("the target against the truth", result["target"], (*GROUPS[:4], "turn corr"))


if __name__ == "__main__":
    main()
