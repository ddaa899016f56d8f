"""Time of the whole stack against the same physics steps alone.

    python benchmarks/physics_share.py [--duration 20] [--gait trot] [--speed 0.06] [--json]

Controller, supervisor, simulated servos and sensors, truth, recorder and loop
run a walk as ``bluefoot run`` does, without a report. After every half second of
it the same physics steps run again, alone, in the same process: torques and
friction of a recorded run are replayed into bare ``mj_step`` calls without
sensors. That gives the same trajectory to the bit, which is checked at the end.

Times of the stages come from another run of the same walk, because taking them
costs time too. They are medians of what a stage itself takes, without the stages
that it calls.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from collections import defaultdict
from pathlib import Path

import mujoco
import numpy as np

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


class Stack:
    """Everything that a run consists of."""

    def __init__(self, resolved):
        self.resolved = resolved
        self.model = RobotModel(resolved.parameters)
        self.simulator = SimRobot(self.model, resolved.stages.sim, resolved.run.seed)
        self.supervisor = supervise(self.simulator, self.model, resolved)
        self.pipeline = Pipeline(self.model, resolved.stages.control, self.simulator.period)
        self.recorder = None

    def run(self, observers=(), prepare=None):
        """One run, recorded to a file that is thrown away."""
        table = self.resolved.table()
        with (
            tempfile.TemporaryDirectory() as folder,
            Recorder(Path(folder) / "log.mcap", table) as self.recorder,
        ):
            if prepare is not None:
                prepare(self)
            truth = self.simulator.truth
            hooks = LoopHooks(recorder=self.recorder, truth=truth, observers=tuple(observers))
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
    stack.run()
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
    p50, p99 = np.percentile(1e6 * np.array(seconds), [50.0, 99.0])
    return {"p50": float(p50), "p99": float(p99)}


def measure(resolved):
    bare = Bare(resolved, *record_physics(resolved))
    stack = Stack(resolved)
    data = stack.run(observers=(bare,))
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
        "physics_us": percentiles(physics),
        "stack_us": percentiles(whole),
        "share_median": float(np.median(whole / physics)),
        "share_total": float(whole.sum() / physics.sum()),
        "stages_us": time_stages(resolved),
    }


def print_table(result):
    print(f"{result['ticks']} ticks, {result['stop_reason']}; µs per tick    median      p99")
    for name, values in sorted(result["stages_us"].items(), key=lambda item: -item[1]["p50"]):
        print(f"  {name:40s} {values['p50']:9.1f} {values['p99']:8.1f}")
    for name, title in (("stack_us", "whole stack"), ("physics_us", "physics alone")):
        print(f"{title:42s} {result[name]['p50']:9.1f} {result[name]['p99']:8.1f}")
    print(
        f"the whole stack takes {result['share_median']:.2f} times the physics alone "
        f"(median of ticks; {result['share_total']:.2f} times in total)"
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenario", default="walk")
    parser.add_argument("--duration", type=float, default=20.0, help="s")
    parser.add_argument("--gait", default=None)
    parser.add_argument("--speed", type=float, default=None, help="m/s")
    parser.add_argument("--set", dest="overrides", action="append", default=[], help="section.key=value")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    chosen = RunOptions(
        duration=options.duration, gait=options.gait, speed=options.speed, overrides=tuple(options.overrides)
    )
    result = measure(resolve(find_scenario(options.scenario), chosen))
    if options.json:
        print(json.dumps(result))
    else:
        print_table(result)


if __name__ == "__main__":
    main()
