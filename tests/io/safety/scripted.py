"""Robots with scripted frames: the test says what the supervisor sees, and learns what reaches the servos."""

from dataclasses import replace

import numpy as np

from bluefoot_mpc.io.findings import Finding, NotArmedError, Severity
from bluefoot_mpc.io.safety import Health, SafetyConfig, SafetySupervisor
from bluefoot_mpc.types import ImuBatch, JointCommand, SensorFrame

PERIOD = 0.02
SIT = np.linspace(-0.4, 0.4, 16)


def make_imu(time, count=4, seed=0):
    """`count` samples up to `time`; none where it is 0."""
    noise = np.random.default_rng([seed, 10_000 + round(time / PERIOD)]).normal(size=(count, 6)) * 1e-2
    return ImuBatch(
        time=time - 0.005 * np.arange(count)[::-1], gyro=noise[:, :3], accel=noise[:, 3:] + [0.0, 0.0, 9.8],
        magnetometer=np.full((count, 3), np.nan), valid=np.ones(count, dtype=bool),
    )  # fmt: skip


def make_frame(time=0.0, **changes):
    frame = SensorFrame(
        time=time,
        joint_position=np.zeros(16), joint_speed=np.zeros(16), joint_load=np.zeros(16),
        joint_temperature=np.full(16, 30.0), joint_time=np.full(16, time),
        joint_valid=np.ones(16, dtype=bool),
        voltage=12.0, voltage_valid=True, imu=make_imu(time, 0), contact=np.ones(4, dtype=bool),
        contact_time=np.full(4, time), contact_valid=np.ones(4, dtype=bool),
    )  # fmt: skip
    return replace(frame, **changes)


class FakeRobot:
    """A robot without power of its own: it returns the frame that it is told to."""

    period = PERIOD

    def __init__(self):
        self.sent = []
        self.next = make_frame()
        self.stops = 0

    def reset(self):
        return self.next

    def step(self, command):
        self.sent.append(command)
        return self.next

    def stop(self):
        self.stops += 1

    def close(self):
        pass


class FakePoweredRobot:
    """A robot that must be armed, with a latch below; its frames are healthy but for `changes`.

    Attributes:
        moved: goals that passed the latch with torque, since the last `arm`.
        changes: fields of the frames to come, by name; callables are given the time.
        findings: what `preflight` finds.
        log: calls in their order.
    """

    period = PERIOD

    def __init__(self):
        self.time = 0.0
        self.position = np.full(16, 0.3)
        self.changes = {}
        self.findings = ()
        self.account = Health(power_on=True)
        self.log = []
        self.sent = []
        self.moved = []
        self.latched = True
        self.sit = None
        self.at_step = None
        self.at_arm = None

    def frame(self):
        changes = {
            name: value(self.time) if callable(value) else value for name, value in self.changes.items()
        }
        healthy = {"joint_position": self.position.copy(), "imu": make_imu(self.time), "time": self.time}
        return make_frame(**{**healthy, **changes})

    def reset(self):
        self.log.append("reset")
        self.latched = True
        return self.frame()

    def preflight(self):
        self.log.append("preflight")
        return self.findings

    def arm(self, torque_limit):
        self.log.append("arm")
        self.latched = False
        if self.at_arm is not None:
            self.at_arm()
        self.moved.clear()
        self.armed_with = torque_limit
        return self.frame()

    def watch_over(self, sit):
        self.sit = sit

    def step(self, command):
        self.sent.append(command)
        if not self.latched and command.torque_limit.any():
            self.moved.append(command)
            self.position = np.where(command.torque_limit > 0.0, command.position, self.position)
        self.time += self.period
        if self.at_step is not None:
            self.at_step()
        return self.frame()

    def health(self):
        return self.account

    def disarm(self):
        self.log.append("disarm")
        self.latched = True

    def stop(self):
        self.log.append("stop")
        self.latched = True

    def close(self):
        self.stop()


def supervise(robot, **config):
    return SafetySupervisor(robot, np.full(16, -1.0), np.full(16, 1.0), SafetyConfig(**config))


def goal(value, torque=1.0):
    return JointCommand(position=np.full(16, value), speed=np.zeros(16), torque_limit=np.full(16, torque))


def play(supervisor, seconds, command=None):
    """Step for a while; gives the frames."""
    command = goal(0.3) if command is None else command
    return [supervisor.step(command) for _ in range(round(seconds / PERIOD))]


def refusal(text="model is 18, not 12"):
    return Finding(part="servo 7 (FR_knee)", text=text, mend="Change it", severity=Severity.REFUSAL)


def not_armed():
    return NotArmedError([refusal()])
