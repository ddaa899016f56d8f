"""Time of the whole stack against the same physics steps alone.

    python benchmarks/physics_share.py [--duration 20] [--controller mpc] [--gait trot] [--speed 0.06]
        [--json]

A walk runs as ``bluefoot run`` runs it, without a report. Three times, because
"the whole stack" can be read in three ways: controller, supervisor, simulated
servos and sensors, battery and loop; then with the simulator's truth, which
only reports need; then with the recorder as well. After every half second of a
run the same physics steps run again, alone, in the same process: torques and
friction of a recorded run are replayed into bare ``mj_step`` calls without
sensors. That gives the same trajectory to the bit, which is checked at the end.

Times of the stages come from another run of the same walk, because taking them
costs time too. They are what a stage itself takes, without the stages that it
calls; the recorder works once in five ticks, so its mean says more than its
median.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from collections import defaultdict
from contextlib import ExitStack
from pathlib import Path

import mujoco
import numpy as np

from bluefoot_mpc.control.names import CONTROLLERS
from bluefoot_mpc.control.pipeline import Pipeline
from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.runtime.loop import LoopHooks, run_loop
from bluefoot_mpc.runtime.recorder import Recorder
from bluefoot_mpc.scenarios import RunOptions, find_scenario
from bluefoot_mpc.scenarios.config import resolve
from bluefoot_mpc.scenarios.runner import supervise
from bluefoot_mpc.sim.robot import SimRobot

BLOCK = 25
"""Ticks between two replays: often enough to meet the same load of the machine,
and seldom enough to leave the stack its warm caches."""
WARM_UP = 0.1
"""Share of the ticks that are left out at the start."""
STACKS = {
    "control and simulation": (False, False),
    "with the truth": (True, False),
    "with the truth and the recorder": (True, True),
}
"""What counts as the stack: whether the truth is read, whether a log is written."""


class Stack:
    """Everything that a run consists of."""

    def __init__(self, resolved):
        self.resolved = resolved
        self.model = RobotModel(resolved.parameters)
        self.simulator = SimRobot(self.model, resolved.stages.sim, resolved.run.seed)
        self.supervisor = supervise(self.simulator, self.model, resolved)
        self.pipeline = Pipeline(self.model, resolved.stages.control, self.simulator.period)
        self.recorder = None

    def run(self, observers=(), truth=True, record=True, prepare=lambda stack: None):
        """One run; what is recorded goes to a file that is thrown away."""
        table = self.resolved.table()
        with ExitStack() as context:
            if record:
                folder = Path(context.enter_context(tempfile.TemporaryDirectory()))
                self.recorder = context.enter_context(Recorder(folder / "log.mcap", table))
            prepare(self)
            hooks = LoopHooks(
                recorder=self.recorder,
                truth=self.simulator.truth if truth else None,
                observers=tuple(observers),
            )
            return run_loop(self.supervisor, self.pipeline, self.resolved.scenario.source, hooks, table)


def record_physics(resolved):
    """What the servos wrote in every physics step of a run: (steps, 16) torques and frictions."""
    stack = Stack(resolved)
    simulator, bank = stack.simulator, stack.simulator._bank
    drive, friction, advance = [], [], bank.advance

    def spy():
        advance()
        if simulator._step >= 0:  # the robot settles before time zero
            drive.append(bank.plant.drive.copy())
            friction.append(bank.plant.friction.copy())

    bank.advance = spy
    stack.run(truth=False, record=False)
    return np.array(drive), np.array(friction)


class Bare:
    """The same physics steps, with nothing around them.

    As an observer of the loop it also takes the time between its calls, which
    is that of one tick of the stack.
    """

    def __init__(self, resolved, drive, friction):
        self._robot = SimRobot(RobotModel(resolved.parameters), resolved.stages.sim, resolved.run.seed)
        self._robot.model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
        sim = resolved.stages.sim
        self._steps = round(sim.command_period / sim.physics_period)
        self._drive, self._friction = drive, friction
        self._done, self._left = 0, time.perf_counter()
        self.physics, self.stack = [], []

    @property
    def positions(self):
        return self._robot.data.qpos

    def __call__(self, frame, output, truth):
        """Close a tick of the stack."""
        self.stack.append(time.perf_counter() - self._left)
        if len(self.stack) % BLOCK == 0:
            self.catch_up()
        self._left = time.perf_counter()

    def catch_up(self):
        """Run the physics of the ticks that the stack has completed; the first only starts one."""
        while len(self.physics) < len(self.stack) - 1:
            self.physics.append(self._tick())

    def _tick(self):
        """Time in mj_step over one command period, s."""
        plant, model, data, spent = self._robot._bank.plant, self._robot.model, self._robot.data, 0.0
        span = slice(self._done, self._done + self._steps)
        for torque, loss in zip(self._drive[span], self._friction[span], strict=True):
            plant.drive[:] = torque
            plant.friction[:] = loss
            start = time.perf_counter()
            mujoco.mj_step(model, data)
            spent += time.perf_counter() - start
        self._done += self._steps
        return spent


class Stopwatch:
    """Own times of nested calls, tick by tick."""

    def __init__(self):
        self.ticks = defaultdict(list)
        self._now = defaultdict(float)
        self._inner = [0.0]
        self._last = time.perf_counter()

    def watch(self, owner, method, name):
        """Replace a method by one that is timed under `name`."""
        call = getattr(owner, method)

        def timed(*args):
            self._inner.append(0.0)
            start = time.perf_counter()
            try:
                return call(*args)
            finally:
                spent = time.perf_counter() - start
                self._now[name] += spent - self._inner.pop()
                self._inner[-1] += spent

        setattr(owner, method, timed)

    def tick(self, frame, output, truth):
        now = time.perf_counter()
        self._now["loop"] = now - self._last - self._inner[0]
        for name, spent in self._now.items():
            self.ticks[name].append(spent)
        self._now, self._inner, self._last = defaultdict(float), [0.0], time.perf_counter()


def watch_stages(watch, stack):
    simulator, pipeline, recorder = stack.simulator, stack.pipeline, stack.recorder
    watch.watch(simulator, "_advance", "sim: physics and servos")
    watch.watch(stack.supervisor, "step", "safety")
    watch.watch(simulator, "step", "sim: sensors")
    watch.watch(pipeline, "step", "control: rest")
    watch.watch(pipeline._estimator, "step", "estimation")
    watch.watch(pipeline._gait, "step", "gait")
    watch.watch(pipeline._trunk, "step", "control: trunk")
    watch.watch(pipeline._targets, "step", "control: joint targets")
    for name in ("frame", "command", "telemetry", "truth"):
        watch.watch(recorder, name, "recorder")


def time_stages(resolved):
    stack, watch = Stack(resolved), Stopwatch()

    def prepare(stack):
        watch_stages(watch, stack)
        watch.watch(stack.simulator, "truth", "sim: truth")

    data = stack.run(observers=(watch.tick,), prepare=prepare)
    skip = int(WARM_UP * len(data.frames))
    return {name: percentiles(values[skip:]) for name, values in watch.ticks.items()}


def percentiles(seconds):
    microseconds = 1e6 * np.array(seconds)
    p50, p99 = np.percentile(microseconds, [50.0, 99.0])
    return {"p50": float(p50), "p99": float(p99), "mean": float(microseconds.mean())}


def compare(resolved, replay, truth, record):
    """Times of a stack and of the physics in it, and how many times the one is the other."""
    bare, stack = Bare(resolved, *replay), Stack(resolved)
    data = stack.run((bare,), truth, record)
    bare.catch_up()
    bare._tick()  # the loop ends with a step that no observer sees
    if not np.array_equal(stack.simulator.data.qpos, bare.positions):
        raise SystemExit("the replayed physics went another way: the comparison is void")
    # The loop's tick k holds the frame that tick k - 1 commanded: so do physics[k - 1] and stack[k].
    physics, whole = np.array(bare.physics), np.array(bare.stack[1:])
    skip = int(WARM_UP * len(whole))
    physics, whole = physics[skip:], whole[skip:]
    return {
        "ticks": len(whole),
        "stop_reason": data.stop_reason,
        "stack_us": percentiles(whole),
        "physics_us": percentiles(physics),
        "ratio_of_medians": float(np.median(whole) / np.median(physics)),
        "median_of_ratios": float(np.median(whole / physics)),
        "ratio_of_totals": float(whole.sum() / physics.sum()),
    }


def measure(resolved):
    replay = record_physics(resolved)
    return {
        "stacks": {name: compare(resolved, replay, *parts) for name, parts in STACKS.items()},
        "stages_us": time_stages(resolved),
    }


def print_table(result):
    first = next(iter(result["stacks"].values()))
    print(f"{first['ticks']} ticks, {first['stop_reason']}; µs per tick        median      mean      p99")
    rows = [(f"  {name}", values) for name, values in result["stages_us"].items()]
    rows.sort(key=lambda row: -row[1]["mean"])
    for name, stack in result["stacks"].items():
        rows += [(name, stack["stack_us"]), ("  physics alone beside it", stack["physics_us"])]
    for name, values in rows:
        print(f"{name:42s} {values['p50']:9.1f} {values['mean']:9.1f} {values['p99']:8.1f}")
    print("times the physics alone: by medians, median of the ticks' ratios, in total")
    for name, stack in result["stacks"].items():
        ratios = (stack["ratio_of_medians"], stack["median_of_ratios"], stack["ratio_of_totals"])
        print(f"{name:42s} " + " ".join(f"{ratio:9.2f}" for ratio in ratios))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenario", default="walk")
    parser.add_argument("--duration", type=float, default=20.0, help="s")
    parser.add_argument("--gait", default=None)
    parser.add_argument("--controller", choices=CONTROLLERS, default=None)
    parser.add_argument("--speed", type=float, default=None, help="m/s")
    parser.add_argument("--set", dest="overrides", action="append", default=[], help="section.key=value")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    chosen = RunOptions(
        duration=options.duration,
        controller=options.controller,
        gait=options.gait,
        speed=options.speed,
        overrides=tuple(options.overrides),
    )
    result = measure(resolve(find_scenario(options.scenario), chosen))
    if options.json:
        print(json.dumps(result))
    else:
        print_table(result)


if __name__ == "__main__":
    main()
