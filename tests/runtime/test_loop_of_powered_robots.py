"""How a run on a robot that must be armed ends; no simulator."""

from dataclasses import replace

import numpy as np
import pytest

from bluefoot_mpc.control.pipeline import ControlOutput
from bluefoot_mpc.io.safety import SafetyState
from bluefoot_mpc.runtime.loop import REST_TIMEOUT, LoopHooks, run_loop
from bluefoot_mpc.types import CameraImage, Mode, MotionCommand
from tests.io.safety.scripted import FakePoweredRobot, goal, supervise
from tests.runtime.made_up_run import telemetry


class Restless:
    """A controller that goes on standing whatever it is told."""

    def reset(self):
        pass

    def step(self, frame, motion, safety):
        account = telemetry(np.random.default_rng(0), frame.time, motion)
        return ControlOutput(command=goal(0.3), telemetry=replace(account, mode=Mode.STAND))


def test_a_controller_that_does_not_come_to_rest_at_the_end_is_relieved_and_the_robot_lowered():
    fake = FakePoweredRobot()
    supervisor = supervise(fake)
    supervisor.watch_over(np.full(16, -0.2))
    source = lambda now: MotionCommand() if now < 0.1 else None  # noqa: E731
    data = run_loop(supervisor, Restless(), source, LoopHooks(rests=True), {})
    assert supervisor.state is SafetyState.STOPPED
    assert fake.log[-2:] == ["disarm", "stop"]  # never stopped at once while it had torque
    limits = np.array([command.torque_limit.max() for command in fake.moved])
    assert limits[-1] < 0.1
    assert np.diff(limits[-20:]).max() <= 0.0
    np.testing.assert_allclose(fake.moved[-1].position, -0.2, atol=1e-9)
    assert data.stop_reason == "completed"
    assert fake.time == pytest.approx(1.0 + 0.1 + REST_TIMEOUT + 0.5 / 0.8 + 0.6, abs=0.2)


def test_pictures_are_shown_and_not_kept():
    fake = FakePoweredRobot()
    picture = CameraImage(time=0.0, pixels=np.zeros((2, 2, 3), dtype=np.uint8), valid=True)
    fake.changes = {"camera": picture}
    seen = []
    hooks = LoopHooks(observers=(lambda frame, output, truth: seen.append(frame.camera),))
    data = run_loop(
        supervise(fake), Restless(), lambda now: MotionCommand() if now < 1.0 else None, hooks, {}
    )
    assert len(data.frames) == len(seen) > 10
    assert all(image is picture for image in seen)
    assert all(frame.camera is None for frame in data.frames)
