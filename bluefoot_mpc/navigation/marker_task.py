"""Approaching and following a marker: what camera, target, servoing and search come to on each tick."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from bluefoot_mpc.model.parameters import SensorMounts
from bluefoot_mpc.navigation import servoing
from bluefoot_mpc.navigation.limits import Motion
from bluefoot_mpc.navigation.marker import MarkerConfig, MarkerFinder, Sighting
from bluefoot_mpc.navigation.search import Phase, Search, SearchConfig
from bluefoot_mpc.navigation.servoing import Servo, ServoingConfig
from bluefoot_mpc.navigation.target import Target, TargetConfig
from bluefoot_mpc.settings import require_positive, require_range
from bluefoot_mpc.types import BodyState, CameraImage, FloatArray, Guide, Guided, GuideTask, SensorFrame


@dataclass(frozen=True, kw_only=True, slots=True)
class MarkerTaskConfig:
    """Configuration of the parts, and how a marker that stands is gone to."""

    finder: MarkerConfig = field(default_factory=MarkerConfig)
    target: TargetConfig = field(default_factory=TargetConfig)
    servoing: ServoingConfig = field(default_factory=ServoingConfig)
    search: SearchConfig = field(default_factory=SearchConfig)
    remember: float = 90.0  # s for which a marker that stands is gone to without a sighting
    remember_beyond: float = 0.5  # m more than the wanted distance: nearer it must be in view
    blink: float = 0.5  # s without a picture after which what was found in the last one counts no more
    blind: float = 2.0  # s without a picture after which the robot stands
    detour: float = 1.15  # times the straight line: a longer way is one around something
    detour_least: float = 0.2  # m, that do not count

    def __post_init__(self) -> None:
        require_positive(
            remember=self.remember, remember_beyond=self.remember_beyond, detour_least=self.detour_least,
            blink=self.blink, blind=self.blind,
        )  # fmt: skip
        require_range(1.0, 10.0, detour=self.detour)


@dataclass(frozen=True, kw_only=True, slots=True)
class MarkerWish:
    """What the marker asks of this tick.

    Wanted motion = `share` · `motion` + (1 − `share`) · LIDAR, where LIDAR is the way to `goal` around what
    stands there (as to a waypoint), or the plain potential field where there is no goal. The guard comes
    behind it as always.

    Attributes:
        guided: MARKER while it leads, ARRIVED while the robot stands at its distance, BLIND without pictures,
            SEARCH otherwise.
        motion: m/s and rad/s, heading frame.
        share: of `motion` in the command, 0..1; that of its prediction where the marker is hidden shortly.
        goal: (2,) m in the odometry frame; None without one.
        pitch: rad, of the trunk, nose down positive.
        mixing: the camera's share for the report: κ, and 0 while the marker is not seen.
        marker: (3,) px, column, row and radius in the newest picture; NaN where unseen.
        position: (3,) m, the marker's centre in the odometry frame as last seen or predicted; NaN before.
        age: s since it was last seen; infinite before.
        reason: in few words.
    """

    guided: Guided
    motion: Motion
    share: float
    goal: FloatArray | None
    pitch: float
    mixing: float
    marker: FloatArray
    position: FloatArray
    age: float
    reason: str


class MarkerTask:
    """The tasks APPROACH and FOLLOW.

    How to call: `step(guide, frame, estimate, dt)` on each tick of such a task, `reset()` with the navigator.

    Args:
        config: of the parts.
        mounts: where the camera is and how wide it looks.
    """

    def __init__(self, config: MarkerTaskConfig, mounts: SensorMounts) -> None:
        self._config = config
        self._finder = MarkerFinder(config.finder, mounts.camera_view_deg)
        self._target = Target(config.target, mounts)
        self._search = Search(config.search)
        self._mounts = mounts
        self._ball_focal = config.target.marker_radius * mounts.focal_length(640)  # m px
        self._camera_ahead = mounts.camera[0]
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._target.reset()
        self._search.reset()
        self._servo = Servo()
        self._sighting: Sighting | None = None
        self._reason = "no picture yet"
        self._pictured: float | None = None

    def step(self, guide: Guide, frame: SensorFrame, estimate: BodyState, dt: float) -> MarkerWish:
        """One tick.

        Args:
            guide: the task, its speed and distance.
            frame: newest sensor frame; its picture is looked at where there is one.
            estimate: where the robot is.
            dt: s, command period.
        """
        self._target.remember(estimate)
        if frame.camera is not None:
            self._look(frame.camera, guide.task is GuideTask.FOLLOW)
        unseeing = self._without_picture(frame)
        if unseeing > self._config.blink:
            self._sighting = None
        seen = self._sighting
        row = math.nan if seen is None else seen.row
        wanted = servoing.camera_pitch(row, 1 if seen is None else seen.height, self._config.servoing)
        self._servo = servoing.pitched(self._servo, wanted, dt, self._config.servoing)
        if unseeing > self._config.blind:
            self._reason = f"no picture of the camera for {unseeing:.0f} s"
            return self._wish(estimate, Guided.BLIND, (Motion(), 1.0, None), 0.0)
        if self._leads(guide, estimate):
            self._search.reset()
            return self._lead(guide, estimate)
        self._servo = self._servo._replace(standing=False)
        return self._seek(estimate)

    def _leads(self, guide: Guide, estimate: BodyState) -> bool:
        """True while the marker is in view or predicted, or stands farther off where it has been seen."""
        if self._target.trusted(estimate.time):
            return True
        if guide.task is GuideTask.FOLLOW or self._target.age(estimate.time) > self._config.remember:
            return False
        relative = self._target.relative(estimate)
        return relative is not None and relative.distance > guide.distance + self._config.remember_beyond

    def _without_picture(self, frame: SensorFrame) -> float:
        """For how long there was no usable picture, s; counted from the beginning of the task."""
        if self._pictured is None or (frame.camera is not None and frame.camera.valid):
            self._pictured = frame.time
        return frame.time - self._pictured

    def _look(self, image: CameraImage, moves: bool) -> None:
        self._sighting = self._finder.find(image, self._expected(image))
        self._reason = self._finder.reason
        if self._sighting is not None and not self._target.see(self._sighting, moves):
            self._sighting = None
            self._reason = "a marker is seen, but not where it can be"

    def _expected(self, image: CameraImage) -> tuple[float, float, float] | None:
        """Where in a picture the marker should be; None where the picture has no size or nothing is known."""
        shape: tuple[int, ...] = getattr(image.pixels, "shape", ())
        if len(shape) < 2 or not math.isfinite(image.time):
            return None
        height, width = int(shape[0]), int(shape[1])
        return self._target.expected(image.time, self._mounts.focal_length(width), (width, height))

    def _lead(self, guide: Guide, estimate: BodyState) -> MarkerWish:
        """Towards the marker, seen or predicted, or stand."""
        config = self._config.servoing
        relative = self._target.relative(estimate)
        if relative is None:
            return self._seek(estimate)
        law = servoing.follow if guide.task is GuideTask.FOLLOW else servoing.approach
        self._servo, motion = law(self._servo, relative, guide.distance, guide.speed, config)
        # The radius that the marker has at this distance: a moment without a sighting, for which its place
        # is predicted, does not change who leads. The report's share is zero then.
        radius = self._ball_focal / max(relative.distance, 0.05)
        near = self._target.trusted(estimate.time)
        share = servoing.mixing(radius if near else 0.0, config)
        if self._servo.standing:
            share = 1.0
        goal = self._stand_off(estimate, guide.distance)
        guided = Guided.ARRIVED if self._servo.standing else Guided.MARKER
        mixing = share if self._sighting is not None else 0.0
        return self._wish(estimate, guided, (motion, share, goal), mixing)

    def _seek(self, estimate: BodyState) -> MarkerWish:
        """The marker is not in view: look for it, first where it should be."""
        relative = self._target.relative(estimate)
        place = None if relative is None else self._target.position_at(estimate.time)
        wish = self._search.step(estimate, place, 0.0 if relative is None else relative.across)
        self._reason = str(wish.phase)
        if wish.phase is Phase.WANDER:
            self._target.forget()
        share = 0.0 if wish.motion is None else 1.0
        return self._wish(estimate, Guided.SEARCH, (wish.motion or Motion(), share, wish.goal), 0.0)

    def _stand_off(self, estimate: BodyState, distance: float) -> FloatArray:
        """(2,) m, odometry frame: on the line to the marker, where the trunk is at the wanted distance."""
        marker = self._target.position_at(estimate.time)[:2]
        way = marker - estimate.position[:2]
        far = float(np.hypot(*way))
        return np.asarray(marker - way * min(1.0, (distance + self._camera_ahead) / max(far, 1e-6)))

    def _wish(
        self, estimate: BodyState, guided: Guided, lead: tuple[Motion, float, FloatArray | None],
        mixing: float,
    ) -> MarkerWish:  # fmt: skip
        seen = self._sighting
        marker = np.full(3, np.nan) if seen is None else np.array([seen.column, seen.row, seen.radius])
        return MarkerWish(
            guided=guided, motion=lead[0], share=lead[1], goal=lead[2], pitch=self._servo.pitch,
            mixing=mixing, marker=marker, position=self._target.position_at(estimate.time),
            age=self._target.age(estimate.time), reason="" if guided is Guided.ARRIVED else self._reason,
        )  # fmt: skip
