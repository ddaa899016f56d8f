"""The safety supervisor: one wrapper around every robot, the simulated one included.

Below it nothing but checked commands reach the servos: finite, inside the
joint limits, no faster than the servos can follow. Above it the controller
learns, one tick later, what the supervisor wants it to do. A robot that must be
armed is armed, stopped and switched off by it (``states.py``).
"""

from __future__ import annotations

import logging

from bluefoot_mpc.exceptions import DeviceError
from bluefoot_mpc.io.findings import Finding, NotArmedError, Severity
from bluefoot_mpc.io.robot import PoweredRobot, Robot
from bluefoot_mpc.io.safety import sink, states
from bluefoot_mpc.io.safety.config import SafetyConfig
from bluefoot_mpc.io.safety.faults import Fault, FaultBook, Response
from bluefoot_mpc.io.safety.gate import CommandGate, capped, known, unusable_joints, usable
from bluefoot_mpc.io.safety.guard import EMERGENCY
from bluefoot_mpc.io.safety.health import Watched
from bluefoot_mpc.io.safety.monitoring import Monitors
from bluefoot_mpc.io.safety.sink import Sink
from bluefoot_mpc.io.safety.states import Checks, Inputs, Machine, SafetyState
from bluefoot_mpc.types import FloatArray, JointCommand, SafetyRequest, SensorFrame

log = logging.getLogger(__name__)


class ArmingInterruptedError(NotArmedError):
    """Somebody ended the arming (Ctrl-C, an emergency stop); no torque is on."""


class SafetySupervisor:
    """Checks every command on its way down and every frame on its way up.

    One thread steps it; `emergency` and `interrupt` may be called from any.

    Args:
        robot: the robot to protect.
        lower: (16,) rad, lowest goal that may be sent.
        upper: (16,) rad, highest goal that may be sent.
        config: thresholds.
    """

    def __init__(self, robot: Robot, lower: FloatArray, upper: FloatArray, config: SafetyConfig) -> None:
        self.robot = robot
        self.period = robot.period
        self._config = config
        self._powered = robot if isinstance(robot, PoweredRobot) else None
        self._watched = robot if isinstance(robot, Watched) else None
        self._gate = CommandGate(lower, upper, config.max_goal_rate * robot.period)
        self._book = FaultBook()
        self._monitors = Monitors(config, robot.period, powered=self._powered is not None)
        self._sit: FloatArray | None = None
        self._interrupted = False
        self._clear()

    def _clear(self) -> None:
        self._emergency = ""
        # A robot without power of its own is ready at once.
        ready = Machine(state=SafetyState.ACTIVE, torque=1.0)
        self._machine = ready if self._powered is None else Machine()
        self._book.clear()
        self._gate.reset()
        self._monitors.reset()
        self._sink: Sink | None = None
        self._unusable = 0.0
        self._limp = False

    @property
    def state(self) -> SafetyState:
        """How far the robot is allowed to move."""
        return SafetyState.EMERGENCY if self._emergency else self._machine.state

    @property
    def stopped(self) -> bool:
        """True where no torque may be on."""
        return self.state in states.LIMP

    @property
    def limp(self) -> bool:
        """True where a run may end: no torque was sent last, and what must be switched off is."""
        return self.stopped if self._powered is not None else self._limp

    @property
    def request(self) -> SafetyRequest:
        """What the controller should do on the next tick."""
        return self._book.request

    @property
    def warnings(self) -> tuple[str, ...]:
        """What people should know though the robot goes on."""
        return self._book.warnings

    def watch_over(self, sit: FloatArray) -> None:
        """Tell where to sink to when no controller can: (16,) rad, joints of the sitting posture."""
        self._sit = sit
        if self._powered is not None:
            self._powered.watch_over(sit)

    def reset(self) -> SensorFrame:
        """Reset the robot, forget every fault, and arm it where it must be armed.

        Raises:
            NotArmedError: checks failed, a fault came up or somebody interfered; no torque is on.
        """
        self._clear()
        frame = self.robot.reset()
        self._gate.locate(frame)
        return frame if self._powered is None else self._arm(self._powered)

    def arm(self) -> SensorFrame:
        """Arm anew after a stop, faults and emergency forgotten: only when a person asks for it.

        Raises:
            NotArmedError: as in `reset`.
            DeviceError: torque is on already.
        """
        if self._powered is None:
            return self.reset()
        if not self.stopped:
            raise DeviceError("the robot is armed already. Stop it before it is armed anew")
        self._interrupted = False
        self._clear()
        return self._arm(self._powered)

    def step(self, command: JointCommand) -> SensorFrame:
        """Send the command as far as it is safe, and judge the frame that comes back."""
        sent = self._lowered() if self._takes_over() else self.check(command)
        frame = self.robot.step(sent)
        self._watch(frame)
        self._limp = not sent.torque_limit.any()
        self._advance(limp=self._limp)
        return frame

    def check(self, command: JointCommand) -> JointCommand:
        """The command that may be sent: finite, inside limits, slew-limited, under the torque's ceiling."""
        if not usable(command):
            text = f"command is not finite for {unusable_joints(command)}: discarded, the last one is held"
            self._book.note(Fault(key="not finite", response=Response.STOP, text=text))
            self._unusable += self.period
            return self._capped(self._gate.held())
        self._unusable = 0.0
        if self.stopped:
            # No new goal either: a servo may take one as a wish to be switched on.
            return self._capped(self._gate.held())
        passed = self._gate.passed(command)
        if self._gate.complaint is not None:
            self._book.note(self._gate.complaint)
        return self._capped(passed)

    def emergency(self, reason: str) -> None:
        """Torque off and power cut at once, from any thread, in any state, as often as wanted.

        Nothing that follows moves the robot until `reset` or `arm`. From a signal handler use
        `interrupt`: the handler may have cut into the very write that this would repeat.
        """
        if not self._emergency:
            log.error("safety: emergency stop: %s", reason)
        self._emergency = self._emergency or reason or EMERGENCY
        self.robot.stop()

    def interrupt(self) -> None:
        """End an arming under way with the torque off; for signal handlers, does nothing else."""
        self._interrupted = True

    def controlled_stop(self, reason: str) -> None:
        """Lower the robot without a controller, switch it off, and return when that is done.

        A robot that is lost on the way is stopped at once.
        """
        if self.stopped:
            return
        self._book.note(Fault(key="controlled stop", response=Response.STOP, text=reason))
        self._sink = self._begin()
        try:
            while not self.stopped:
                self.step(self._gate.held())
        except DeviceError:
            log.exception("safety: the robot was lost during a controlled stop")
            self.emergency("the robot was lost during a controlled stop")

    def stop(self) -> None:
        """Make the robot limp; later commands keep it so until `reset`."""
        self._machine = Machine(state=SafetyState.STOPPED)
        self.robot.stop()

    def close(self) -> None:
        """Give back the robot's resources."""
        self.robot.close()

    def _capped(self, command: JointCommand) -> JointCommand:
        """The command under the ceiling of the torque limits, from state, heat and dead servos."""
        if self.stopped:
            return capped(command, 0.0)
        if self._machine.torque < 1.0:
            command = capped(command, self._machine.torque)
        ceiling = self._monitors.ceiling
        return command if ceiling is None else capped(command, ceiling)

    def _watch(self, frame: SensorFrame) -> None:
        if self._gate.last is None:
            self._gate.locate(frame)
        if self._powered is None or not self.stopped:
            # A robot that was switched off on purpose has no voltage, and no servo answers.
            self._judge(frame)
        if self._emergency:
            text = f"emergency stop: {self._emergency}"
            self._book.note(Fault(key="emergency", response=Response.EMERGENCY, text=text))

    def _judge(self, frame: SensorFrame) -> None:
        faults = self._monitors.step(frame, self._watched.health() if self._watched is not None else None)
        self._book.take(fault for fault in faults if fault.response is not Response.EMERGENCY)
        for fault in faults:
            if fault.response is Response.EMERGENCY and not self.stopped:
                self.emergency(fault.text)

    def _advance(self, *, arm: bool = False, checks: Checks = Checks.PENDING, limp: bool = False) -> None:
        before = self._machine.state
        inputs = Inputs(
            emergency=bool(self._emergency), arm=arm, checks=checks, level=self._book.request.level,
            limp=limp, rests=self._powered is not None,
        )  # fmt: skip
        self._machine = states.advance(self._machine, inputs, self.period, self._config)
        state = self._machine.state
        if state is not before:
            log.info("safety: %s -> %s", before, state)
        if state is SafetyState.STOPPED and before is not state and self._powered is not None:
            self._powered.disarm()

    def _takes_over(self) -> bool:
        """True while the supervisor lowers the robot itself: nobody else does, or not in time."""
        if self.stopped:
            return False
        if self._sink is None and (
            self._unusable >= self._config.unusable_time or states.overdue(self._machine, self._config)
        ):
            log.error("safety: the controller does not stop the robot: it is lowered without it")
            self._sink = self._begin()
        return self._sink is not None

    def _begin(self) -> Sink:
        held = self._gate.held()
        # A robot that is limp already is not moved once more.
        share = 1.0 if held.torque_limit.any() else 0.0
        return Sink(goal=held.position, torque=held.torque_limit, share=share)

    def _lowered(self) -> JointCommand:
        """The next command of a robot that the supervisor lowers itself."""
        begun = self._begin() if self._sink is None else self._sink
        self._sink = sink.advance(begun, self._sit, self.period, self._config.sink)
        return self._capped(self._gate.passed(self._sink.command()))

    def _arm(self, robot: PoweredRobot) -> SensorFrame:
        """Check, switch on with little torque, and ramp up while holding the present position."""
        try:
            self._advance(arm=True)
            self._check(robot.preflight())
            frame = robot.arm(self._config.arming_torque)
            self._gate.reset()
            self._gate.locate(frame)
            self._advance(checks=Checks.PASSED)
            self._require_calm(frame)
            return self._ramp_up(frame)
        except BaseException:
            # Whatever ended it, Ctrl-C included: the robot is never left half armed.
            self._advance(checks=Checks.REFUSED)
            robot.stop()
            raise

    def _check(self, findings: tuple[Finding, ...]) -> None:
        for finding in findings:
            if finding.severity is Severity.WARNING:
                key = f"{finding.part} {finding.text}"
                self._book.note(Fault(key=key, response=Response.WARN, text=str(finding)))
        if any(finding.severity is Severity.REFUSAL for finding in findings):
            raise NotArmedError(findings)
        self._require_calm(None)

    def _ramp_up(self, frame: SensorFrame) -> SensorFrame:
        # A limp joint may lie a little beyond its limits: it is brought to them as torque comes.
        hold = self._gate.held()
        while self._machine.state is SafetyState.ARMING:
            frame = self.robot.step(self.check(hold))
            self._watch(frame)
            self._advance()
            self._require_calm(None)
        return frame

    def _require_calm(self, frame: SensorFrame | None) -> None:
        """Raise where arming must not go on."""
        why = "somebody ended the arming" if self._interrupted else ""
        if self._emergency:
            why = f"emergency stop: {self._emergency}"
        if why:
            refusal = Finding(part="arming", text=why, mend="Arm anew", severity=Severity.REFUSAL)
            raise ArmingInterruptedError([refusal])
        reasons = self._book.request.reasons if self._machine.state is SafetyState.DISARMED else ()
        if frame is not None and not known(frame).all():
            reasons = ("the position of a servo is not known. Check the plugs",)
        if reasons:
            raise NotArmedError(
                [Finding(part="arming", text=text, severity=Severity.REFUSAL) for text in reasons]
            )
