"""How the robot finds its way: surroundings, the law that leads, the way out of corners, the guard."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.model.parameters import SensorMounts
from bluefoot_mpc.navigation.config import NavigationConfig
from bluefoot_mpc.navigation.escape import Escape, StuckWatch
from bluefoot_mpc.navigation.guard import Guard
from bluefoot_mpc.navigation.leading import Lead, Leading
from bluefoot_mpc.navigation.limits import Motion, allowed, ramped, slowed
from bluefoot_mpc.navigation.scan import LevelScan
from bluefoot_mpc.navigation.surroundings import Surroundings
from bluefoot_mpc.types import BodyState, FloatArray, Guide, Guided, NavigationReport, SensorFrame

_NOWHERE = np.full(3, np.nan)


@dataclass(frozen=True, kw_only=True, slots=True)
class Decision:
    """What navigation wants of the controller on this tick.

    Attributes:
        velocity: (2,) m/s, forward and left in the heading frame.
        yaw_rate: rad/s, left positive.
        pitch: rad, of the trunk, nose down positive.
        report: what it saw and why.
    """

    velocity: FloatArray
    yaw_rate: float
    pitch: float
    report: NavigationReport


class Navigator:
    """Finds the way from LIDAR, camera and the estimated state.

    A tick with a new sweep decides; the ticks between hold the decision, and
    work on the map and on ways over it.

    Args:
        config: of each part.
        mounts: where the sensors are.
    """

    def __init__(self, config: NavigationConfig, mounts: SensorMounts) -> None:
        self._config = config
        self._around = Surroundings(config, mounts)
        self._leading = Leading(config, mounts)
        self._watch = StuckWatch(config.escape)
        self._escape = Escape(config.escape)
        self._guard = Guard(config.guard)
        self.reset()

    def reset(self) -> None:
        """Forget everything: the state after ``__init__``, bit for bit."""
        self._around.reset()
        self._leading.reset()
        self._watch.reset()
        self._escape.reset()
        self._lead = Lead(Guided.BLIND, Motion())
        self._wanted = Motion()
        self._motion = Motion()
        self._gait = Motion()
        self._clearance = math.inf
        self._stalled: float | None = None
        self._time = -math.inf

    def begin(self) -> None:
        """Forget the task, not the surroundings: what comes next is a new one, even if it is the same."""
        self._leading.reset()
        self._begin_afresh()
        self._lead = Lead(Guided.BLIND, Motion())
        self._wanted = self._motion = self._gait = Motion()

    def step(self, guide: Guide, frame: SensorFrame, estimate: BodyState, dt: float) -> Decision:
        """One tick.

        Args:
            guide: the task.
            frame: newest sensor frame.
            estimate: estimated state of the robot.
            dt: s, command period.
        """
        around, leading = self._around, self._leading
        if frame.time - self._time > self._config.scan.stale_after:
            self._begin_afresh()  # it did not walk in between
            self._leading.resume(frame.time - self._time)
            self._wanted = self._motion = self._gait = Motion()
        self._time = frame.time
        fresh = around.step(frame, estimate)
        leading.look(guide, frame, estimate, dt)
        if fresh and around.scan is not None:
            self._decide(guide, around.scan, frame.time)
        elif not around.settle():
            leading.search(guide, around, frame.time)
        blind = around.blind(frame.time)
        if blind:
            self._stand(blind)
        self._motion = ramped(self._motion, self._wanted, dt, self._config.limits)
        self._gait = self._config.guard.ramp.followed(self._gait, self._motion, dt)
        return self._decision()

    def _decide(self, guide: Guide, scan: LevelScan, time: float) -> None:
        """What to do until the next sweep."""
        lead = self._leading.step(guide, self._around, scan)
        self._lead = lead = self._out_of_the_corner(lead, guide.speed, time)
        speed = guide.speed
        if self._around.open_ground and lead.guided is not Guided.MARKER:
            # Open ground looks like this, and so does a LIDAR that is dirty, or was covered from the start.
            speed = min(speed, self._config.scan.open_speed)
            self._lead = lead = lead._replace(reason=lead.reason or "open ground, hardly an echo: slowly")
        wanted = allowed(lead.motion, speed, self._config.limits)
        guarded = self._guard.step(self._around.points(), wanted, self._gait)
        # Of what the guard chooses from, some is faster than the task allows.
        self._wanted, self._clearance = slowed(guarded.motion, speed), guarded.clearance
        if guarded.stopped and not lead.reason:
            self._lead = lead._replace(reason="held up: nothing but standing keeps clear of things")
        escape = self._config.escape
        if escape.is_motion(guarded.motion) or not escape.is_motion(wanted):
            self._stalled = None
        elif self._stalled is None:
            self._stalled = time

    def _out_of_the_corner(self, lead: Lead, speed: float, time: float) -> Lead:
        """The way out in place of what leads, where the robot has been stuck."""
        pose = self._around.pose
        rests = self._watch.rests(pose, time, allowed(lead.motion, speed, self._config.limits))
        # Who is too near to a marker and cannot back off had better keep it in view.
        backs_off = lead.guided is Guided.MARKER and lead.motion.x <= 0.0
        if backs_off or not self._config.escape.is_motion(lead.motion):
            self._begin_afresh()
            return lead
        stuck = rests > self._config.escape.patience
        stalled = self._stalled is not None and time - self._stalled >= self._config.escape.stall
        if not self._escape.active and (stuck or stalled):
            self._escape.begin(pose, time, self._around.openness())
            if stuck:
                self._leading.give_up(time)
        if self._escape.active:
            room = self._guard.away(self._around.points(), self._gait)
            motion = self._escape.step(pose, time, room)
            if self._escape.active:
                return Lead(Guided.ESCAPE, motion, "stuck: making room, turning, backing off in turn")
            self._begin_afresh()
        return lead

    def _stand(self, reason: str) -> None:
        """Nothing to go by: stand, and begin afresh when that ends."""
        self._lead = Lead(Guided.BLIND, Motion(), reason)
        self._wanted = Motion()
        self._leading.rest()
        self._begin_afresh()

    def _begin_afresh(self) -> None:
        """From now on the robot has time to get going."""
        self._watch.reset()
        self._escape.reset()
        self._stalled = None

    def _decision(self) -> Decision:
        leading, wish, scan = self._leading, self._leading.wish, self._around.scan
        velocity = np.array(self._motion[:2])
        pitch = 0.0 if wish is None else wish.pitch
        report = NavigationReport(
            guided=self._lead.guided, velocity=velocity, yaw_rate=self._motion.yaw_rate, pitch=pitch,
            field=leading.field.force, potential=leading.field.potential,
            mixing=0.0 if wish is None else wish.mixing,
            marker=_NOWHERE.copy() if wish is None else wish.marker,
            marker_position=_NOWHERE.copy() if wish is None else wish.position,
            marker_age=math.inf if wish is None else wish.age,
            clearance=self._clearance, waypoints_left=leading.waypoints.left,
            scan_time=math.nan if scan is None else scan.time, reason=self._lead.reason,
        )  # fmt: skip
        return Decision(velocity=velocity, yaw_rate=self._motion.yaw_rate, pitch=pitch, report=report)
