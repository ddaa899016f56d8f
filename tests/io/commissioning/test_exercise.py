"""Moving servos one by one: they follow, or it is said why not; torque is off whatever happens."""

import logging
from dataclasses import replace

import pytest

from bluefoot_mpc.exceptions import ConfigurationError, DeviceError
from bluefoot_mpc.io.commissioning.exercise import ExerciseConfig, exercise
from bluefoot_mpc.io.commissioning.ports import limp_afterwards, torque_off
from bluefoot_mpc.io.commissioning.record import record_steps
from bluefoot_mpc.io.commissioning.steps import StepPlan
from bluefoot_mpc.io.emulation.own_shafts import ShaftConfig, bench_servo

from .bench import CCW_LIMIT, TORQUE, Bench

WEAK = ExerciseConfig(amplitude=34)


def run(bench, servo=1, config=WEAK):
    ports = bench.ports()
    with limp_afterwards(ports, [servo]):
        return exercise(ports.buses[0], servo, bench.clock, config)


def test_a_sound_servo_follows_and_ends_limp():
    bench = Bench()
    result = run(bench, 3)
    assert result.fault == ""
    assert result.asked == -34
    assert abs(result.reached[0] + 34) <= 12
    assert 0.05 < result.time < 1.0
    assert 0.0 < result.peak_load <= 0.45
    assert result.temperature == pytest.approx(25, abs=2)
    assert bench.limp


def test_torque_and_speed_are_low_while_it_moves():
    bench = Bench()
    seen = []
    original = bench.shafts.drive
    bench.shafts.drive = lambda index, drive: (seen.append(drive), original(index, drive))
    run(bench)
    driven = [drive for drive in seen if drive.enabled]
    assert driven
    assert max(drive.torque_limit for drive in driven) <= 410
    assert {drive.speed for drive in driven} == {90}
    assert abs(driven[0].goal - 512) <= 1  # it holds where it stands before it goes anywhere


def test_it_moves_towards_the_middle():
    bench = Bench()
    bench.turn(0, -60.0)
    result = run(bench)
    assert result.asked == 34
    assert result.fault == ""


def test_a_blocked_joint_is_named():
    jammed = replace(bench_servo(), coulomb_friction=5.0)
    bench = Bench(configs=[ShaftConfig(servo=jammed)])
    result = run(bench)
    assert "does not move" in result.fault
    assert "blocked" in result.mend
    assert bench.limp


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda b: setattr(b.line.servos[1], "forced_temperature", 62.0), "62 °C"),
        (lambda b: b.line.servos[1].write(CCW_LIMIT, 0, 2), "wheel mode"),
        (lambda b: b.line.servos[1].write(CCW_LIMIT, 400, 2), "outside its limits 0..400"),
        (lambda b: setattr(b.line.servos[1], "forced_voltage", 5.0), "voltage"),
    ],
)
def test_what_must_not_move_is_left_alone(spoil, words):
    bench = Bench()
    spoil(bench)
    result = run(bench)
    assert words in result.fault
    assert result.mend
    assert bench.limp
    assert bench.line.goal_writes_while_off == 0


@pytest.mark.parametrize("error", [KeyboardInterrupt, RuntimeError])
def test_torque_goes_off_whatever_happens(error):
    bench = Bench()
    ports = bench.ports()

    def work():
        with limp_afterwards(ports, range(1, 17)):
            for servo in range(1, 17):
                ports.buses[0].write(servo, "torque_enable", 1)
            assert not bench.limp
            raise error

    with pytest.raises(error):
        work()
    assert bench.limp


def test_a_servo_that_keeps_its_torque_is_shouted_about(caplog):
    bench = Bench()
    ports = bench.ports()
    bench.line.plug(bench.line.servos[4], False, 0.0)
    with caplog.at_level(logging.ERROR), limp_afterwards(ports, [3, 4]):
        pass
    assert "servo 4: cut the servos' power" in caplog.text
    assert torque_off(ports, [3]) == ()


def test_steps_are_recorded_and_torque_is_off_afterwards():
    bench = Bench(count=1)
    ports = bench.ports()
    plan = StepPlan(amplitudes_deg=(8.0,), duration=0.3)
    records = record_steps(ports.buses[0], 1, plan, bench.clock)
    assert [round(r.goal - 512) for r in records] == [27, 0, -27, 0]
    for record in records:
        assert abs(record.position[-1] - record.goal) <= 3
        assert abs(record.position[0] - record.start) <= 1
        assert (record.time[1:] > record.time[:-1]).all()
        assert len(record.time) > 300  # more than one reading a millisecond
        assert record.voltage == pytest.approx(12.0, abs=0.15)
    assert bench.line.servos[1].read(TORQUE) == 0
    assert bench.line.violations == 0


def test_steps_that_leave_the_limits_are_refused():
    bench = Bench(count=1)
    bench.line.servos[1].write(CCW_LIMIT, 530, 2)
    with pytest.raises(DeviceError, match="smaller --amplitudes"):
        record_steps(bench.ports().buses[0], 1, StepPlan(), bench.clock)
    assert bench.line.goal_writes_while_off == 0


def test_a_hot_servo_is_not_stepped():
    bench = Bench(count=1)
    bench.line.servos[1].forced_temperature = 61.0
    with pytest.raises(DeviceError, match="61 °C"):
        record_steps(bench.ports().buses[0], 1, StepPlan(), bench.clock)
    assert bench.limp


def test_impossible_plans_are_refused():
    for wrong in ({"amplitudes_deg": ()}, {"amplitudes_deg": (80.0,)}, {"middle": 50}, {"torque_limit": 0.0}):
        with pytest.raises(ConfigurationError):
            StepPlan(**wrong)
