import time

import pytest

from bluefoot_mpc.io.pacing import PacedRobot
from bluefoot_mpc.io.robot import Robot
from tests.io.safety.scripted import FakeRobot, goal


class Clock:
    """A wall clock that only sleeping and `spend` move."""

    def __init__(self) -> None:
        self.now = 100.0

    def monotonic(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        assert seconds >= 0.0
        self.now += seconds


@pytest.fixture
def clock(monkeypatch):
    made = Clock()
    monkeypatch.setattr(time, "monotonic", made.monotonic)
    monkeypatch.setattr(time, "sleep", made.sleep)
    return made


def test_steps_take_a_period_and_a_late_one_is_not_made_up_for(clock):
    fake = FakeRobot()
    paced = PacedRobot(fake)
    assert isinstance(paced, Robot)
    assert paced.period == fake.period
    paced.reset()
    paced.step(goal(0.0))
    assert clock.now == pytest.approx(100.02)
    clock.now += 0.015  # thinking
    paced.step(goal(0.0))
    assert clock.now == pytest.approx(100.04)
    clock.now += 0.5  # much too late
    paced.step(goal(0.0))
    assert clock.now == pytest.approx(100.54)
    paced.step(goal(0.0))
    assert clock.now == pytest.approx(100.56)


def test_a_reset_starts_the_clock_anew(clock):
    paced = PacedRobot(FakeRobot())
    clock.now += 10.0
    paced.reset()
    paced.step(goal(0.0))
    assert clock.now == pytest.approx(110.02)


def test_stop_reaches_the_robot(clock):
    fake = FakeRobot()
    PacedRobot(fake).stop()
    assert fake.stops == 1
