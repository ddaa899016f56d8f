"""Levelling of a walking robot whose sensors, network or source fail: it lets go, and the robot walks on."""

import math
from dataclasses import replace

import numpy as np
import pytest

from bluefoot_mpc.leveling import compensator as module
from bluefoot_mpc.leveling.config import LevelingLimits
from bluefoot_mpc.leveling.narx import save_weights
from bluefoot_mpc.sim.config import PushConfig, SimConfig
from bluefoot_mpc.types import Mode
from tests.control.test_faults import frozen_imu, nan_imu, silent_imu, silent_joints
from tests.leveling.bench import Told
from tests.leveling.loop import SPEED, Leveling, leveled_walk

pytestmark = pytest.mark.slow

BOTH = pytest.mark.parametrize("controller", ["cpg", "mpc"])
MOST_TILT = {"cpg": 12.0, "mpc": 5.0}
"""Degrees; without levelling the slow trot of the paper's laws tilts by up to 7, model-based control 0.6."""
SHIFT = LevelingLimits().shift


@pytest.fixture(scope="module")
def taught(tmp_path_factory):
    """Weights of a network that has walked for a while, by controller."""
    folder, files = tmp_path_factory.mktemp("taught"), {}
    with pytest.MonkeyPatch.context() as patch:
        for controller in ("cpg", "mpc"):
            walked = leveled_walk(patch, controller, 10.0, psi="network", schedule={"learn_time": 100.0})
            files[controller] = str(folder / f"{controller}.npz")
            save_weights(folder / f"{controller}.npz", walked.stage.compensator.source.weights)
    return files


def check_goals(run: Leveling) -> None:
    """Nothing but numbers near the gait's own goals."""
    assert np.isfinite(run.given).all()
    assert np.isfinite([output.command.position for output in run.trace.outputs]).all()
    assert run.shift.max() <= SHIFT + 1e-12


def check(run: Leveling, controller: str) -> None:
    """The same, and no fall."""
    check_goals(run)
    assert not run.trace.fell
    assert run.trace.tilt_deg.max() < MOST_TILT[controller]


def share_at(run: Leveling, time: float) -> float:
    return float(run.share[np.searchsorted(run.trace.time, time - 1e-9)])


def check_walks(run: Leveling, start: float, end: float) -> None:
    """It walks at its speed, more or less, from `start` to `end` (s)."""
    inside = run.trace.between(start, end)
    assert run.trace.walking[inside].all()
    way = np.diff(run.trace.position[inside, 0][[0, -1]])[0]
    assert way > 0.7 * SPEED * (end - start)


# Sensors. Each fails on one tick at 3.0 s, and for a second from 4.0 s on.


def nan_joints(frame):
    return replace(frame, joint_position=np.full(16, np.nan))


def nan_speeds(frame):
    return replace(frame, joint_speed=np.full(16, np.nan))


def nan_accelerometer(frame):
    return replace(frame, imu=replace(frame.imu, accel=np.full_like(frame.imu.accel, np.nan)))


def nan_last_sample(frame):
    gyro = frame.imu.gyro.copy()
    gyro[-1:] = np.nan
    return replace(frame, imu=replace(frame.imu, gyro=gyro))


def no_voltage(frame):
    return replace(frame, voltage=math.nan)


def infinite_voltage(frame):
    return replace(frame, voltage=math.inf)


def zero_voltage(frame):
    return replace(frame, voltage=0.0, voltage_valid=False)


BLINDING = [nan_joints, silent_joints, silent_imu, nan_imu, nan_accelerometer, frozen_imu]
BEARABLE = [nan_speeds, nan_last_sample, no_voltage, zero_voltage, infinite_voltage]


def twice(fault):
    return lambda frame: fault(frame) if _wrong(frame.time) else frame


def _wrong(time: float) -> bool:
    return 3.0 <= time < 3.01 or 4.0 <= time < 5.0


@BOTH
@pytest.mark.parametrize("fault", BLINDING)
def test_without_an_estimate_it_lets_go_and_comes_back(monkeypatch, taught, controller, fault):
    run = leveled_walk(
        monkeypatch, controller, 8.0, fault=twice(fault), psi="network", weights=taught[controller]
    )
    check(run, controller)
    assert share_at(run, 4.9) == 0.0
    assert any("levelling off" in event for event in run.events)
    assert run.events[-1] == "levelling on again"
    assert share_at(run, 7.9) == 1.0
    check_walks(run, 7.0, 8.0)


@BOTH
@pytest.mark.parametrize("fault", BEARABLE)
def test_what_the_estimate_bears_levelling_bears(monkeypatch, controller, fault):
    run = leveled_walk(monkeypatch, controller, 6.0, fault=twice(fault), psi="zero")
    check(run, controller)
    assert run.events == []
    assert np.all(run.share[run.trace.between(2.5, 6.0)] == 1.0)
    torque = np.array([report.torque for report in run.reports])
    assert np.isfinite(torque).all()
    check_walks(run, 3.0, 6.0)


# The network and other sources.


@BOTH
@pytest.mark.parametrize("value", [1e6, math.nan])
def test_a_sabotaged_network_is_switched_off_for_good(monkeypatch, taught, controller, value):
    def sabotage(stage, time):
        if 4.0 <= time < 4.01:
            stage.compensator.source._narx._perceptron.weights[:] = value

    run = leveled_walk(monkeypatch, controller, 7.0, each=sabotage, psi="network", weights=taught[controller])
    check(run, controller)
    assert share_at(run, 3.9) == 1.0
    assert np.all(run.share[run.trace.between(4.3, 7.0)] == 0.0)
    assert run.events[-1] == "levelling off: the network has diverged"
    inside = run.trace.between(4.3, 7.0)
    np.testing.assert_array_equal(run.given[inside], run.asked[inside])
    check_walks(run, 4.3, 7.0)


def scrambled(stage, time):
    if 4.0 <= time < 4.01:
        weights = stage.compensator.source._narx._perceptron.weights
        weights[:] = np.random.default_rng(1).normal(0.0, 0.7, len(weights))


@BOTH
def test_a_network_with_scrambled_weights_is_doubted(monkeypatch, taught, controller):
    run = leveled_walk(
        monkeypatch, controller, 7.0, each=scrambled, psi="network", weights=taught[controller]
    )
    check(run, controller)
    assert "levelling off: the network predicts worse than nothing" in run.events
    assert np.all(run.share[run.trace.between(4.5, 5.0)] == 0.0)


NONSENSE = {
    "high": lambda time: np.full(22, 1e6),
    "low": lambda time: np.full(22, -1e6),
    "turning": lambda time: 1e6 * np.sin(2.0 * np.pi * time + np.arange(22.0)),
    "random": lambda time: np.random.default_rng(round(50 * time)).normal(0.0, 1e6, 22),
    "endless": lambda time: np.full(22, 1e300),
}


@pytest.mark.parametrize(
    ("controller", "attitude", "nonsense"),
    [
        ("cpg", True, "high"), ("cpg", False, "low"), ("cpg", False, "turning"), ("cpg", False, "random"),
        ("mpc", True, "turning"), ("mpc", False, "endless"), ("mpc", True, "random"),
    ],
)  # fmt: skip
def test_a_source_that_talks_nonsense_throws_nobody(monkeypatch, controller, attitude, nonsense):
    source = Told()

    def talk(stage, time):
        source.psi = NONSENSE[nonsense](time) if 3.0 <= time < 5.0 else np.zeros(22)

    monkeypatch.setattr(module, "make_source", lambda *_: source)
    run = leveled_walk(monkeypatch, controller, 6.5, each=talk, attitude=attitude)
    check(run, controller)
    talking = run.trace.between(3.0, 5.0)
    believed = np.abs([report.disturbance for report in run.reports])
    assert believed.max() <= LevelingLimits().disturbance
    assert run.shift[talking].max() > 0.02  # it did try
    check_walks(run, 5.5, 6.5)


@BOTH
def test_goals_at_their_limits_for_long_switch_it_off(monkeypatch, controller):
    source = Told()

    def talk(stage, time):
        source.psi = np.full(22, 1e6) if time >= 3.0 else np.zeros(22)

    monkeypatch.setattr(module, "make_source", lambda *_: source)
    limits = {"disturbance": 1e4, "shift": 0.1, "clamped": 0.3}
    run = leveled_walk(monkeypatch, controller, 6.5, each=talk, attitude=False, limits=limits)
    check(run, controller)
    assert run.shift.max() <= 0.1 + 1e-12
    assert run.events == ["levelling off: half of the goals were at their limits for too long"]
    assert np.all(run.share[run.trace.between(3.6, 6.5)] == 0.0)
    check_walks(run, 5.0, 6.5)


@BOTH
def test_a_push_pauses_it_and_it_comes_back(monkeypatch, controller):
    push = PushConfig(time=4.0, impulse=7.0, direction_deg=180.0)
    limit = {"cpg": 7.2, "mpc": 3.0}[controller]
    run = leveled_walk(
        monkeypatch, controller, 8.0, sim=SimConfig(pushes=(push,)), psi="zero", limits={"tilt_deg": limit}
    )
    check_goals(run)
    assert run.trace.tilt_deg.max() < 15.0
    assert run.events == [
        f"levelling off: the trunk tilts by more than {limit:g} degrees",
        "levelling on again",
    ]
    assert share_at(run, 3.9) == 1.0
    assert np.any(run.share[run.trace.between(4.0, 5.0)] == 0.0)
    assert share_at(run, 7.9) == 1.0
    assert run.trace.modes == [Mode.STAND, Mode.WALK]
    check_walks(run, 6.0, 8.0)
