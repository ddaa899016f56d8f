"""Single runs of a validation: the figures mean what their limits take them for."""

import pytest

from bluefoot_mpc.evaluation import validation_measure as module
from bluefoot_mpc.evaluation.cases import Case
from bluefoot_mpc.evaluation.validation_cases import CUT, DRIVEN_WELL
from bluefoot_mpc.evaluation.validation_measure import measure_validation, run_options
from bluefoot_mpc.evaluation.validation_subject import subject_of
from bluefoot_mpc.io.safety import SafetySupervisor
from bluefoot_mpc.scenarios import RunOptions

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def config(tmp_path_factory):
    file = tmp_path_factory.mktemp("validation") / "c.toml"
    # The paper's laws: nothing to compile.
    subject_of(RunOptions(controller="cpg")).write(file)
    return file


def case(config, scenario, robot, **options):
    given = {"robot": robot, "config": str(config), "randomize": "standard", **options}
    return Case(name="made up", scenario=scenario, options=given)


def broken(limits, figures):
    return [limit.figure for limit in limits if not limit.keeps(figures.get(limit.figure))]


@pytest.mark.parametrize("robot", ["sim", "emulator"])
def test_an_emergency_stop_is_timed_on_the_robots_own_clock(config, robot):
    figures = measure_validation(case(config, "emergency stop", robot, duration=2.0), 0)
    assert broken(CUT, figures) == []
    assert 0.0 < figures["emergency_ms"] <= 100.0
    if robot == "emulator":
        assert broken(DRIVEN_WELL, figures) == []


@pytest.mark.parametrize("robot", ["sim", "emulator"])
def test_an_emergency_stop_that_does_nothing_is_seen(config, robot, monkeypatch):
    monkeypatch.setattr(SafetySupervisor, "emergency", lambda self, reason: None)
    figures = measure_validation(case(config, "emergency stop", robot, duration=2.0), 0)
    assert figures["emergency_ms"] is None
    assert figures["torque_left"] > 0
    if robot == "emulator":
        assert figures["goals_after"] == 10


def test_a_controlled_stop_ends_limp_and_level(config):
    figures = measure_validation(
        case(config, "controlled stop", "emulator", duration=5.0, speed=0.06, gait="trot"), 0
    )
    assert figures["falls"] == 0.0
    assert 0.5 < figures["rest_s"] < 6.0
    assert figures["rest_tilt_deg"] < 10.0
    assert figures["torque_left"] == 0.0
    simulated = measure_validation(
        case(config, "controlled stop", "sim", duration=3.0, speed=0.06, gait="trot"), 0
    )
    assert simulated["torque_left"] == 0.0


def test_a_fall_is_seen(config):
    figures = measure_validation(
        case(config, "push", "sim", duration=4.0, speed=0.06, gait="trot", impulse=40.0, push_time=2.0), 0
    )
    assert figures["falls"] == 1.0


def test_standing_has_no_speed(config):
    figures = measure_validation(case(config, "stand", "sim", duration=5.0), 0)
    assert figures["speed_error_percent"] is None
    assert figures["roll_rms_deg"] < 1.0


def test_events_come_at_another_part_of_the_cycle_with_every_seed(config):
    options = {"duration": 8.0, "speed": 0.06, "gait": "trot"}
    stops = [run_options(case(config, "controlled stop", "sim", **options), s).duration for s in range(3)]
    assert len({round(stop, 6) for stop in stops}) == 3
    pushes = [
        run_options(case(config, "push", "sim", push_time=5.0, **options), seed).push_time
        for seed in range(3)
    ]
    assert len({round(push, 6) for push in pushes}) == 3
    assert run_options(case(config, "walk", "sim", **options), 2).duration == 8.0


def test_an_interrupted_run_tells_nothing(config, monkeypatch):
    class Ended:
        stop_reason = "interrupted"

    monkeypatch.setattr(module, "run_loop", lambda *arguments: Ended())
    with pytest.raises(KeyboardInterrupt):
        measure_validation(case(config, "stand", "sim", duration=5.0), 0)
