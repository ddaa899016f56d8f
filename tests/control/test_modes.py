import pytest

from bluefoot_mpc.control.modes import ModeConfig, ModeState, advance
from bluefoot_mpc.types import Mode, SafetyLevel, SafetyRequest

DT = 0.02
CONFIG = ModeConfig()


def play(state, wanted, seconds, *, safety=None, walking=False, tilt=0.0):
    for _ in range(round(seconds / DT)):
        state = advance(state, wanted, safety or SafetyRequest(), walking, tilt, DT, CONFIG)
    return state


def test_stands_walks_and_stands_again():
    state = play(ModeState(), Mode.WALK, 0.1)
    assert state.mode is Mode.WALK
    state = play(state, Mode.STAND, 1.0, walking=True)
    assert state.mode is Mode.WALK  # feet first
    assert state.ending > 0.9
    state = play(state, Mode.STAND, DT, walking=False)
    assert state.mode is Mode.STAND
    assert state.ending == 0.0


def test_sitting_takes_its_time_and_off_goes_limp_only_when_down():
    state = play(ModeState(), Mode.OFF, 0.5 * CONFIG.sit_time)
    assert 0.0 < state.sit_level < 1.0
    assert state.torque == 1.0
    state = play(state, Mode.OFF, CONFIG.sit_time + CONFIG.limp_time)
    assert state.sit_level == 1.0
    assert state.torque == 0.0


def test_walking_waits_until_the_robot_stands():
    state = play(ModeState(), Mode.SIT, 2.0 * CONFIG.sit_time)
    assert state.sit_level == 1.0
    state = play(state, Mode.WALK, 0.5 * CONFIG.sit_time)
    assert state.mode is Mode.STAND
    assert play(state, Mode.WALK, CONFIG.sit_time).mode is Mode.WALK


def test_a_fall_makes_it_limp_at_once_and_for_good():
    state = play(ModeState(mode=Mode.WALK), Mode.WALK, DT, walking=True, tilt=60.0)
    assert state.mode is Mode.SAFE
    assert "60 degrees" in state.reason
    state = play(state, Mode.WALK, CONFIG.limp_time + 0.1, walking=True)
    assert state.torque == 0.0
    assert play(state, Mode.WALK, 10.0).mode is Mode.SAFE


@pytest.mark.parametrize(
    ("level", "mode"),
    [(SafetyLevel.HOLD, Mode.STAND), (SafetyLevel.SIT, Mode.SIT), (SafetyLevel.STOP, Mode.SAFE)],
)
def test_the_supervisor_overrules_the_operator(level, mode):
    safety = SafetyRequest(level=level, reasons=("because",))
    state = play(ModeState(mode=Mode.WALK), Mode.WALK, 0.1, safety=safety)
    assert state.mode is mode


def test_a_safety_stop_does_not_wait_for_ever_for_the_feet():
    safety = SafetyRequest(level=SafetyLevel.STOP, reasons=("battery empty",))
    state = play(ModeState(mode=Mode.WALK), Mode.WALK, 10.0, safety=safety, walking=True)
    assert state.sit_level == 1.0
    assert state.torque == 0.0
    assert state.reason == "battery empty"


def test_safe_never_gives_torque_back():
    limp = play(ModeState(), Mode.OFF, 5.0)
    stop = SafetyRequest(level=SafetyLevel.STOP, reasons=("hot",))
    state = limp
    for _ in range(100):
        state = play(state, Mode.STAND, DT, safety=stop)
        assert state.mode is Mode.SAFE
        assert state.torque == 0.0
    rising = play(limp, Mode.STAND, 0.3)
    assert 0.0 < rising.torque < 1.0
    assert rising.sit_level < 1.0
    assert play(rising, Mode.STAND, DT, safety=stop).torque <= rising.torque


def test_the_first_reason_stays():
    state = play(ModeState(), Mode.STAND, DT, safety=SafetyRequest(level=SafetyLevel.STOP, reasons=("hot",)))
    later = SafetyRequest(level=SafetyLevel.STOP, reasons=("hot", "empty"))
    assert play(state, Mode.STAND, 1.0, safety=later).reason == "hot"
    fallen = play(state, Mode.STAND, DT, safety=later, tilt=70.0)
    assert fallen.reason == "hot"
    assert fallen.fallen


def test_safe_cannot_be_asked_for():
    assert play(ModeState(), Mode.SAFE, 1.0).mode is Mode.STAND


@pytest.mark.parametrize("wanted", [Mode.SIT, Mode.OFF, Mode.STAND])
def test_a_hold_only_ends_walking(wanted):
    hold = SafetyRequest(level=SafetyLevel.HOLD, reasons=("silence",))
    assert play(ModeState(), wanted, 1.0, safety=hold).mode is wanted


def test_a_sit_request_that_passes_lets_the_robot_stand_again():
    sit = SafetyRequest(level=SafetyLevel.SIT, reasons=("silence",))
    state = play(ModeState(mode=Mode.WALK), Mode.WALK, 3.0, safety=sit)
    assert state.mode is Mode.SIT
    assert state.torque == 1.0
    assert play(state, Mode.WALK, 2.0).mode is Mode.WALK


def test_an_operators_stop_waits_for_the_feet_as_long_as_it_takes():
    state = play(ModeState(mode=Mode.WALK), Mode.OFF, 10.0, walking=True)
    assert state.mode is Mode.WALK
    assert state.torque == 1.0


def test_the_fall_tilt_is_the_configured_one():
    assert play(ModeState(), Mode.STAND, DT, tilt=CONFIG.fall_tilt_deg - 0.1).mode is Mode.STAND
    assert play(ModeState(), Mode.STAND, DT, tilt=CONFIG.fall_tilt_deg + 0.1).mode is Mode.SAFE
