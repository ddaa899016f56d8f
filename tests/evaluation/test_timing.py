import time

import pytest

from bluefoot_mpc import load_robot
from bluefoot_mpc.control.pipeline import Pipeline
from bluefoot_mpc.evaluation.timing import (
    PHYSICS,
    STAGES,
    TICK,
    WHOLE,
    Stopwatch,
    part,
    time_layers,
    watch_pipeline,
)
from bluefoot_mpc.scenarios import RunOptions
from bluefoot_mpc.scenarios.config import resolve
from bluefoot_mpc.scenarios.registry import find_scenario


def spend(seconds):
    end = time.perf_counter() + seconds
    while time.perf_counter() < end:
        pass


def test_a_layer_owns_its_time_without_the_layers_it_calls():
    watch = Stopwatch()
    inner = watch.timed(lambda: spend(0.004), "inner")
    outer = watch.timed(lambda: (inner(), spend(0.001), inner()), "outer")
    outer()
    watch.tick()
    (tick,) = watch.ticks
    assert tick["inner"] >= 0.008
    assert 0.001 <= tick["outer"] < 0.008
    assert watch.percentiles()["inner"].p50 == pytest.approx(1e6 * tick["inner"])


def test_a_layer_that_raises_is_closed():
    watch = Stopwatch()

    def fail():
        raise ValueError("no")

    with pytest.raises(ValueError, match="no"):
        watch.timed(fail, "x")()
    watch.tick(keep=False)
    assert watch.ticks == []
    watch.timed(lambda: None, "y")()
    watch.tick()
    assert set(watch.ticks[0]) == {"y"}


def test_a_tick_without_the_call_counts_as_none_spent():
    watch = Stopwatch()
    for k in range(4):
        if k % 4 == 0:
            watch.note("rare", 1e-3)
        watch.note("always", 2e-3)
        watch.tick()
    found = watch.percentiles()
    assert found["rare"].p50 == 0.0
    assert found["rare"].mean == pytest.approx(250.0)
    assert found["always"].p50 == pytest.approx(2000.0)


@pytest.mark.parametrize("controller", ["cpg", "mpc"])
def test_layers_of_a_real_run_make_up_the_tick(controller):
    found = time_layers("stand", {"run": RunOptions(controller=controller, duration=3.2)})["run"]
    assert {"estimation", "gait", "inverse kinematics", "rest of the tick", PHYSICS} <= set(found)
    assert 0.0 < found[TICK].p50 < found[WHOLE].p50
    layers = sum(times.p50 for name, times in found.items() if name not in (TICK, WHOLE))
    assert layers > 0.5 * found[TICK].p50


def test_every_layer_is_a_method_of_a_part_of_the_full_controller():
    options = RunOptions(controller="mpc", overrides=("control.sway.walk=preview",))
    control = resolve(find_scenario("walk"), options).stages.control
    pipeline = Pipeline(load_robot(), control, 0.02)
    for path, method, _ in STAGES:
        assert callable(getattr(part(pipeline, path), method)), (path, method)
    watch_pipeline(Stopwatch(), pipeline)
    pipeline.reset()
