"""Identification: known parameters of emulated servos are found again through the servo bus."""

import dataclasses

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError, DeviceError
from bluefoot_mpc.io.commissioning.record import record_steps
from bluefoot_mpc.io.commissioning.steps import StepPlan, StepRecord
from bluefoot_mpc.io.emulation.own_shafts import ShaftConfig, bench_servo
from bluefoot_mpc.model.parameters import load_parameters
from bluefoot_mpc.settings import dump_toml
from bluefoot_mpc.tuning.identify import (
    IdentifyConfig,
    fragment,
    identify,
    median_fit,
    start_of,
    vector,
)
from bluefoot_mpc.tuning.identify_model import Bench, StepBench
from bluefoot_mpc.tuning.identify_page import load_steps, save_picture, save_steps

from ..io.commissioning.bench import Bench as ServoBench

pytestmark = pytest.mark.slow

STIFFNESS_ERROR, ARMATURE_ERROR = 0.04, 0.05
"""Shares by which the fit may miss what the emulator has (docs/commissioning.md)."""
COULOMB_ERROR, VISCOUS_ERROR, LATENCY_ERROR = 0.010, 0.006, 0.0015
"""N·m, N·m·s/rad, s. The emulator's joints move in steps of 1 ms, half of which looks like latency."""


def steps_of(changes, gain, latency, plan, **load):
    """Recorded steps of one emulated servo."""
    servo = dataclasses.replace(bench_servo(), **changes)
    bench = ServoBench(configs=[ShaftConfig(servo=servo, gain=gain, latency=latency, **load)])
    records = record_steps(bench.ports().buses[0], 1, plan, bench.clock)
    assert bench.limp
    return servo, records


def check(found, servo, gain, latency):
    fit = found.fit
    assert fit.stiffness == pytest.approx(servo.stiffness * gain, rel=STIFFNESS_ERROR)
    assert fit.armature == pytest.approx(servo.armature, rel=ARMATURE_ERROR)
    assert fit.coulomb_friction == pytest.approx(servo.coulomb_friction, abs=COULOMB_ERROR)
    assert fit.viscous_friction == pytest.approx(servo.viscous_friction, abs=VISCOUS_ERROR)
    assert fit.latency == pytest.approx(latency, abs=LATENCY_ERROR)
    assert found.trusted


def test_known_parameters_are_found_again():
    changes = {"armature": 0.0045, "coulomb_friction": 0.07, "viscous_friction": 0.012, "load_friction": 0.0}
    plan = StepPlan(amplitudes_deg=(4.0, 10.0, 25.0), duration=0.3)
    servo, records = steps_of(changes, 1.2, 0.008, plan)
    model = dataclasses.replace(bench_servo(), load_friction=0.0)  # the fit starts from other values
    check(identify(records, Bench(servo=model), IdentifyConfig(groups=0)), servo, 1.2, 0.008)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("changes", "gain", "latency"),
    [
        ({"armature": 0.0025, "coulomb_friction": 0.03, "viscous_friction": 0.002}, 0.85, 0.004),
        ({"armature": 0.0035, "coulomb_friction": 0.05, "viscous_friction": 0.005}, 1.0, 0.0),
        ({"armature": 0.0045, "coulomb_friction": 0.06, "viscous_friction": 0.010}, 1.1, 0.008),
        ({"armature": 0.0060, "coulomb_friction": 0.09, "viscous_friction": 0.020}, 1.3, 0.015),
    ],
)
def test_the_whole_plan_finds_parameters_with_friction_under_load(changes, gain, latency):
    servo, records = steps_of(changes, gain, latency, StepPlan())
    found = identify(records, Bench(servo=bench_servo(), load_friction_speed=0.1))
    check(found, servo, gain, latency)
    spread, fit = found.spread, found.fit
    assert spread.armature < 0.05 * fit.armature
    assert spread.stiffness < 0.05 * fit.stiffness


def test_without_sysid_the_fit_is_the_same(monkeypatch):
    records = made_up(dataclasses.replace(start_of(bench_servo()), stiffness=11.0, latency=0.01))
    bench, config = Bench(servo=bench_servo()), IdentifyConfig(groups=0)
    with_it = vector(identify(records, bench, config).fit)
    monkeypatch.setattr("bluefoot_mpc.tuning.identify.load_sysid", lambda: None)
    assert vector(identify(records, bench, config).fit) == pytest.approx(with_it, rel=1e-6)


@pytest.mark.slow
def test_a_weight_on_a_lever_enters_the_fit():
    load = {"load_inertia": 0.004, "gravity": 0.25, "gravity_angle": 0.0}
    servo, records = steps_of({"load_friction": 0.0}, 1.0, 0.005, StepPlan(duration=0.8), **load)
    model = dataclasses.replace(bench_servo(), load_friction=0.0)
    bench = Bench(servo=model, load_inertia=0.004, load_moment=0.25)
    check(identify(records, bench, IdentifyConfig(groups=0)), servo, 1.0, 0.005)


def made_up(fit, goals=(27, 0, -80, 0)):
    """Steps that the fit's own model makes."""
    time = np.arange(0.0, 0.3, 0.001)
    records, start = [], 512.0
    for goal in goals:
        records.append(
            StepRecord(
                servo=3, start=start, goal=512 + goal, time=time, position=np.zeros_like(time), voltage=12.0
            )
        )
        start = 512.0 + goal
    curves = StepBench(records, Bench(servo=bench_servo())).at_readings(fit)
    return [dataclasses.replace(r, position=np.round(c)) for r, c in zip(records, curves, strict=True)]


def test_latency_shifts_and_torque_limit_slows():
    fit = start_of(bench_servo())
    early, late = (made_up(dataclasses.replace(fit, latency=s)) for s in (0.0, 0.02))
    assert np.array_equal(early[2].position[:-20], late[2].position[20:])
    weak = [dataclasses.replace(record, torque_limit=0.3) for record in early]
    curves = StepBench(weak, Bench(servo=bench_servo())).at_readings(fit)
    assert np.argmax(curves[2] < 500) > np.argmax(early[2].position < 500)


def test_a_shaft_that_does_not_move_cannot_be_fitted():
    records = [
        dataclasses.replace(r, position=np.full(300, r.start)) for r in made_up(start_of(bench_servo()))
    ]
    with pytest.raises(DeviceError, match="servo 3 followed only 0 of 4 steps"):
        identify(records, Bench(servo=bench_servo()))
    with pytest.raises(ConfigurationError, match="no recorded steps"):
        identify([], Bench(servo=bench_servo()))


def test_a_servo_that_breaks_the_law_is_not_trusted():
    records = made_up(start_of(bench_servo()))
    wobbly = [
        dataclasses.replace(r, position=r.position + 6.0 * np.sign(np.sin(40.0 * r.time))) for r in records
    ]
    assert not identify(wobbly, Bench(servo=bench_servo()), IdentifyConfig(groups=0)).trusted


def test_the_fragment_is_what_the_simulator_loads(tmp_path):
    from bluefoot_mpc.scenarios.config import resolve
    from bluefoot_mpc.scenarios.options import RunOptions
    from bluefoot_mpc.scenarios.registry import find_scenario

    parameters = load_parameters()
    fit = dataclasses.replace(start_of(parameters.servo), stiffness=12.0, armature=0.004, latency=0.013)
    file = tmp_path / "servo.toml"
    file.write_text(dump_toml(fragment(fit, parameters.servo)))
    resolved = resolve(find_scenario("walk"), RunOptions(config=file))
    assert resolved.parameters.servo.stiffness == pytest.approx(12.0, rel=1e-4)
    assert resolved.parameters.servo.armature == 0.004
    assert resolved.stages.sim.latency == 0.013


def test_the_median_is_taken_parameter_by_parameter():
    records = made_up(start_of(bench_servo()))
    one = identify(records, Bench(servo=bench_servo()), IdentifyConfig(groups=0))
    others = [
        dataclasses.replace(one, fit=dataclasses.replace(one.fit, armature=a, latency=t))
        for a, t in ((0.001, 0.03), (0.002, 0.01), (0.009, 0.02))
    ]
    middle = median_fit(others)
    assert (middle.armature, middle.latency) == (0.002, 0.02)
    assert vector(middle)[0] == pytest.approx(one.fit.stiffness)


def test_steps_and_pictures_are_kept(tmp_path):
    records = made_up(start_of(bench_servo()))
    save_steps(records, tmp_path / "deep" / "steps.json")
    loaded = load_steps(tmp_path / "deep" / "steps.json")
    assert np.array_equal(loaded[2].position, records[2].position)
    assert loaded[2].goal == records[2].goal
    bench = Bench(servo=bench_servo())
    found = identify(loaded, bench, IdentifyConfig(groups=0))
    picture = save_picture(found, bench, tmp_path / "pictures")
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("text", ["", "{}", '[{"servo": 1}]', '[{"time": [], "position": []}]', "[1]"])
def test_a_file_without_steps_is_named(tmp_path, text):
    file = tmp_path / "steps.json"
    file.write_text(text)
    with pytest.raises(ConfigurationError, match=r"steps\.json"):
        load_steps(file)


def test_a_missing_file_of_steps_is_named(tmp_path):
    with pytest.raises(ConfigurationError, match="cannot read"):
        load_steps(tmp_path / "none.json")
