"""Time of every layer, taken from outside while a scenario runs as it always does."""

from __future__ import annotations

import functools
import operator
import time
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from bluefoot_mpc.control.pipeline import Pipeline
from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.runtime.loop import LoopHooks, Observer, run_loop
from bluefoot_mpc.scenarios import RunOptions
from bluefoot_mpc.scenarios.config import resolve
from bluefoot_mpc.scenarios.registry import find_scenario
from bluefoot_mpc.scenarios.runner import supervise
from bluefoot_mpc.sim.robot import SimRobot
from bluefoot_mpc.types import SensorFrame

_WHOLE_BODY = "_planner._controller._assembly"
STAGES: tuple[tuple[str, str, str], ...] = (
    ("_estimator", "step", "estimation"),
    ("_gait", "step", "gait"),
    ("_trunk._sway._preview", "_schedule", "contact schedule"),
    ("_trunk._sway._preview._preview", "step", "ZMP preview"),
    ("_trunk._sway", "step", "sway"),
    ("_trunk", "step", "trunk reference"),
    ("_targets", "step", "inverse kinematics"),
    ("_body", "step", "planned body"),
    (_WHOLE_BODY, "fill", "WBC assembly"),
    (_WHOLE_BODY, "assemble", "WBC assembly"),
    (_WHOLE_BODY, "free_optimum", "WBC solve"),
    (_WHOLE_BODY, "evaluate", "WBC evaluation"),
    ("_planner", "step", "WBC references"),
    ("", "_goals", "servo mapping"),
)
"""Object of the pipeline, method, layer; what a configuration does not have is left out."""
_SOLVERS = "_planner._controller._solvers"
WARM_UP = 2.5
"""s at the start of a run that are left out: standing, and the first steps."""
ROUNDS = 2
"""Times that every run is repeated, in turn with the others."""
TICK, REST = "whole tick", "rest of the tick"
PHYSICS, SIMULATION, WHOLE = "physics", "sensors and servos", "tick and simulation"


@dataclass(frozen=True, kw_only=True, slots=True)
class Timing:
    """Time of one layer per tick.

    Attributes:
        p50: µs, median.
        p99: µs, 99th percentile.
        mean: µs.
    """

    p50: float
    p99: float
    mean: float


class Stopwatch:
    """Own times of calls that may lie in one another, added up tick by tick."""

    def __init__(self) -> None:
        self.ticks: list[dict[str, float]] = []
        self._now: dict[str, float] = defaultdict(float)
        self._inner = [0.0]

    def timed(self, call: Callable[..., Any], name: str) -> Callable[..., Any]:
        """The same function, timed under `name` less what timed functions inside it take."""

        @functools.wraps(call)
        def wrapped(*args: Any, **options: Any) -> Any:
            self._inner.append(0.0)
            start = time.perf_counter()
            try:
                return call(*args, **options)
            finally:
                spent = time.perf_counter() - start
                self._now[name] += spent - self._inner.pop()
                self._inner[-1] += spent

        return wrapped

    def note(self, name: str, spent: float) -> None:
        """Add a time (s) that was taken elsewhere."""
        self._now[name] += spent

    def tick(self, keep: bool = True) -> None:
        """Close a tick."""
        if keep:
            self.ticks.append(dict(self._now))
        self._now.clear()
        self._inner = [0.0]

    def percentiles(self) -> dict[str, Timing]:
        """Timing of every name; a tick without the call counts as zero."""
        names = dict.fromkeys(name for tick in self.ticks for name in tick)
        return {name: _timing([tick.get(name, 0.0) for tick in self.ticks]) for name in names}


def time_layers(
    scenario: str, runs: Mapping[str, RunOptions], progress: Callable[[], None] = lambda: None
) -> dict[str, dict[str, Timing]]:
    """Time of every layer per tick, by name of the run.

    The runs take turns in this process, so that all meet the same load of the
    machine. Layers come from runs with clocks in them; the whole tick, and tick
    and simulation together, from the same runs without.

    Args:
        scenario: name of a scenario.
        runs: name to options; runs must be longer than `WARM_UP`.
        progress: called after every turn of a run.
    """
    layered = {name: Stopwatch() for name in runs}
    plain = {name: Stopwatch() for name in runs}
    for _ in range(ROUNDS):
        for name, options in runs.items():
            _run_layered(scenario, options, layered[name])
            _run_plain(scenario, options, plain[name])
            progress()
    return {name: {**layered[name].percentiles(), **plain[name].percentiles()} for name in runs}


class _Stack:
    """A run put together, its parts within reach."""

    def __init__(self, scenario: str, options: RunOptions) -> None:
        resolved = resolve(find_scenario(scenario), options)
        model = RobotModel(resolved.parameters)
        self._source = resolved.scenario.source
        self.simulator = SimRobot(model, resolved.stages.sim, resolved.run.seed)
        self._supervised = supervise(self.simulator, model, resolved)
        self.pipeline = Pipeline(model, resolved.stages.control, self.simulator.period)

    def run(self, observer: Observer) -> None:
        """Run to the end."""
        run_loop(self._supervised, self.pipeline, self._source, LoopHooks(observers=(observer,)), {})


def _run_layered(scenario: str, options: RunOptions, watch: Stopwatch) -> None:
    stack = _Stack(scenario, options)
    watch_pipeline(watch, stack.pipeline)
    _watch(watch, stack.simulator, "step", SIMULATION)
    with _physics_watched(watch):
        stack.run(lambda frame, output, truth: watch.tick(frame.time > WARM_UP))


def _run_plain(scenario: str, options: RunOptions, watch: Stopwatch) -> None:
    stack = _Stack(scenario, options)
    _watch(watch, stack.pipeline, "step", TICK)
    last = time.perf_counter()

    def close(frame: SensorFrame, *_: object) -> None:
        nonlocal last
        now = time.perf_counter()
        watch.note(WHOLE, now - last)
        watch.tick(frame.time > WARM_UP)
        last = time.perf_counter()

    stack.run(close)


def watch_pipeline(watch: Stopwatch, pipeline: Pipeline) -> None:
    """Time every stage of a pipeline, and what is left of its tick."""
    _watch(watch, pipeline, "step", REST)
    for path, method, name in STAGES:
        owner = part(pipeline, path)
        if owner is not None and hasattr(owner, method):
            _watch(watch, owner, method, name)
    for solver in part(pipeline, _SOLVERS) or ():
        _watch(watch, solver, "solve", "WBC solve")


def part(pipeline: Pipeline, path: str) -> Any:
    """A part of a pipeline by its dotted path ("" is the pipeline itself); None where there is none."""
    try:
        return operator.attrgetter(path)(pipeline) if path else pipeline
    except AttributeError:
        return None


def _watch(watch: Stopwatch, owner: object, method: str, name: str) -> None:
    setattr(owner, method, watch.timed(getattr(owner, method), name))


@contextmanager
def _physics_watched(watch: Stopwatch) -> Iterator[None]:
    step = mujoco.mj_step
    mujoco.mj_step = watch.timed(step, PHYSICS)
    try:
        yield
    finally:
        mujoco.mj_step = step


def _timing(seconds: list[float]) -> Timing:
    microseconds = 1e6 * np.array(seconds)
    p50, p99 = np.percentile(microseconds, [50.0, 99.0]).tolist()
    return Timing(p50=p50, p99=p99, mean=float(microseconds.mean()))
