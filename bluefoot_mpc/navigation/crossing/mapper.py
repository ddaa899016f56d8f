"""What is known of the ground, from sweep to sweep, and what is thought about it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from bluefoot_mpc.model.parameters import RobotParameters
from bluefoot_mpc.navigation.crossing.config import CrossingConfig
from bluefoot_mpc.navigation.crossing.pace import paces
from bluefoot_mpc.navigation.crossing.pose_track import PoseTrack
from bluefoot_mpc.terrain.cloud import lidar_place, scan_points
from bluefoot_mpc.terrain.frame import centres, heights_at
from bluefoot_mpc.terrain.free_space import carved
from bluefoot_mpc.terrain.ground import Ground, rate_ground
from bluefoot_mpc.terrain.height_map import MapBuilder, Region
from bluefoot_mpc.terrain.merge import Walked, merge
from bluefoot_mpc.terrain.outlook import Outlook, outlook
from bluefoot_mpc.terrain.plan import Route, plan_route
from bluefoot_mpc.terrain.registration import align, moved
from bluefoot_mpc.types import BodyState, FloatArray, HeightMap, SensorFrame, TrunkPose

FIT = 0.02
"""m, by which a map may differ from where a foot stands: its errors, and those of the odometry since."""
_SOME_FEET = 2
"""Feet that must fit; one may differ, on an edge, and what is unknown under a foot speaks for nothing."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Thought:
    """What came out of thinking about the ground.

    Attributes:
        ground: the map, and how well feet stand on it.
        route: the way.
        pace: (k,) share of the full speed at each of its poses.
        drift: m, by which the older map was moved sideways.
        place: (2,) m, odometry frame, where the robot then was.
    """

    ground: Ground
    route: Route
    pace: FloatArray
    drift: float
    place: FloatArray


class Mapper:
    """Collects points, and keeps the map that they became.

    Args:
        config: of the crossing.
        robot: where the LIDAR is, and how thick the feet are.
    """

    def __init__(self, config: CrossingConfig, robot: RobotParameters) -> None:
        self._config, self._mounts = config, robot.sensors
        self._foot_radius = robot.legs.foot_radius
        self.reset()

    def reset(self) -> None:
        """Forget the ground."""
        self._collected = Collected(self._config)
        self._track = PoseTrack()
        self._known: HeightMap | None = None
        self._place: FloatArray | None = None
        self._stands = False

    def forget_start(self) -> None:
        """The robot may have been put elsewhere: the map must prove itself where it stands next."""
        self._stands = False

    def stand_on(self, feet: FloatArray, time: float) -> None:
        """Take the ground around standing feet to be even, the first time.

        Not where a map from before fits the feet: the robot may stand amid rough ground. A map that does
        not fit is of some other place, and is forgotten.

        Args:
            feet: (4, 3) m, foot points in the odometry frame.
            time: s.
        """
        under = feet - (0.0, 0.0, self._foot_radius)
        if not self._stands and not _fits(self._known, under):
            radius = self._config.start_radius
            self._known = merge(None, even_ground(under, time, self._config)) if radius > 0.0 else None
            self._place = None  # nothing was walked since it was seen
        self._stands = True

    @property
    def has_seen(self) -> bool:
        """Whether anything was met since the sweep began, or since the last thought."""
        return len(self._collected.builder) > 0

    def ahead(self, pose: FloatArray) -> Outlook | None:
        """The ground ahead of a pose (3,) m, m, rad, as far as it is known; None where none is."""
        return None if self._known is None else outlook(self._known, pose, self._config.outlook)

    def begin_sweep(self) -> None:
        """Forget the points of the last sweep; its map stays."""
        self._collected = Collected(self._config)

    def add(self, points: FloatArray, estimate: BodyState) -> None:
        """Take the points of a scan in.

        Args:
            points: (k, 3) m, odometry frame.
            estimate: of the robot's pose at about that time.
        """
        if len(points):
            origin = lidar_place(estimate.position, estimate.quaternion, self._mounts)
            self._collected.add(points, origin, estimate.time)

    def look(self, frame: SensorFrame, estimate: BodyState) -> FloatArray:
        """(k, 3) m, odometry frame, what a scan of this tick met while walking; it is taken in."""
        if not estimate.healthy:
            return np.zeros((0, 3))
        self._track.add(estimate)
        scan = frame.lidar
        if scan is None or not scan.valid or not abs(frame.time - scan.time) < 0.3:
            return np.zeros((0, 3))
        pose = self._track.at(scan.time)
        points = scan_points(scan, pose.position, pose.quaternion, self._mounts, self._config.cloud)
        self.add(points, estimate)
        return points

    def thinking(self, pose: FloatArray, goal: FloatArray) -> Callable[[], Thought]:
        """Work that maps what was collected and plans a way; later points are for the next one.

        Args:
            pose: (3,) m, m, rad: where the robot is, and its heading.
            goal: (2,) m, odometry frame.
        """
        seen, known, place, config = self._collected, self._known, self._place, self._config
        self._collected = Collected(config)
        way = 0.0 if place is None else float(np.hypot(*(pose[:2] - place)))
        return lambda: think(seen, known, Walked(way=way, place=pose[:2]), Aim(pose, goal), config)

    def take(self, thought: Thought) -> None:
        """Go on from a new map."""
        self._known, self._place = thought.ground.map, thought.place

    def trunk_on_the_way(self, time: float) -> TrunkPose:
        """The trunk while walking: level, or with the nose down to look where it goes."""
        config = self._config
        if not config.incremental:
            return TrunkPose()
        swing = config.walking_swing_deg * math.sin(2.0 * math.pi * time / config.walking_period)
        return TrunkPose(rpy=np.array([0.0, math.radians(config.walking_pitch_deg + swing), 0.0]))


class Collected:
    """Points of scans, and the rays that led to them.

    Args:
        config: of the crossing.
    """

    def __init__(self, config: CrossingConfig) -> None:
        self.builder = MapBuilder(config.map)
        self._points: list[FloatArray] = []
        self._origins: list[FloatArray] = []

    def add(self, points: FloatArray, origin: FloatArray, time: float) -> None:
        """Take the points of a scan in.

        Args:
            points: (k, 3) m, odometry frame.
            origin: (3,) m, the LIDAR.
            time: s.
        """
        self.builder.add(points, time, origin)
        self._points.append(points)
        self._origins.append(np.broadcast_to(origin, points.shape))

    def rays(self) -> tuple[FloatArray, FloatArray]:
        """(k, 3) m, all ends, and (k, 3) m, where each ray came from."""
        if not self._points:
            return np.zeros((0, 3)), np.zeros((0, 3))
        return np.vstack(self._points), np.vstack(self._origins)


@dataclass(frozen=True, slots=True)
class Aim:
    """From where to where.

    Attributes:
        pose: (3,) m, m, rad: the robot.
        goal: (2,) m.
    """

    pose: FloatArray
    goal: FloatArray


def think(
    seen: Collected, known: HeightMap | None, walked: Walked, aim: Aim, config: CrossingConfig
) -> Thought:
    """Map, put together with what was known, rate it for feet, and plan a way.

    Args:
        seen: the newest points.
        known: the map so far; None without one.
        walked: since then.
        aim: from where to where.
        config: how.
    """
    fresh = seen.builder.build(region_around(aim.pose, config))
    drift = 0.0
    if known is not None:
        shift = align(known, fresh, config.align)
        known, drift = moved(known, shift), math.hypot(shift.x, shift.y)
    merged = carved(merge(known, fresh, walked, config.merge), *seen.rays(), config.free_space)
    ground = rate_ground(merged, config.rating)
    x, y, yaw = aim.pose.tolist()
    goal_x, goal_y = aim.goal.tolist()
    route = plan_route(ground.map, (x, y, yaw), (goal_x, goal_y), config.plan, ground.quality)
    route = shortened(route, _stretch(ground.map, aim.pose, config))
    pace = paces(ground.map, route.poses, config.pace) if len(route.poses) else np.zeros(0)
    return Thought(ground=ground, route=route, pace=pace, drift=drift, place=aim.pose[:2])


def _stretch(ground: HeightMap, pose: FloatArray, config: CrossingConfig) -> float:
    """M to walk before the next sweep.

    Where the ground drops, that sweep must join on to what is known: rays there are nearly as steep as it.
    On other ground, what is unknown lies in gaps and behind blocks, and is seen no better from farther away.
    """
    ahead = outlook(ground, pose, config.outlook)
    if ahead is None or ahead.drop < config.sweep.drop:
        return config.stretch
    return min(max(ahead.known_until - config.overlap, config.least_stretch), config.stretch)


def _fits(known: HeightMap | None, under: FloatArray) -> bool:
    """True where feet stand on known ground of a map, at its heights, and no more than one at another.

    Args:
        known: the map; None without one.
        under: (4, 3) m, ground under the feet, odometry frame.
    """
    if known is None:
        return False
    off = np.abs(heights_at(known, under[:, :2]) - under[:, 2])
    fits, differs = np.count_nonzero(off <= FIT), np.count_nonzero(off > FIT)
    return bool(fits >= _SOME_FEET and differs <= 1)


def region_around(pose: FloatArray, config: CrossingConfig) -> Region:
    """The piece of ground that the map keeps: some way around the robot, more of it ahead."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    x = np.array((-config.behind, config.ahead))[:, None]
    y = np.array((-config.aside, config.aside))[None, :]
    across, along = c * x - s * y + pose[0], s * x + c * y + pose[1]
    return Region.spanning(
        (float(across.min()), float(across.max())), (float(along.min()), float(along.max())), config.map.cell
    )


def even_ground(under: FloatArray, time: float, config: CrossingConfig) -> HeightMap:
    """Even ground under and around standing feet, as a map.

    Args:
        under: (4, 3) m, ground under the feet, odometry frame.
        time: s.
        config: how far around.
    """
    middle = under.mean(axis=0)
    radius = config.start_radius
    low, high = middle[:2] - radius, middle[:2] + radius
    ground = _unknown((float(low[0]), float(high[0])), (float(low[1]), float(high[1])), time, config)
    slope, *_ = np.linalg.lstsq(under[:, :2] - middle[:2], under[:, 2] - middle[2], rcond=None)
    away = centres(ground) - middle[:2]
    near = np.hypot(away[..., 0], away[..., 1]) <= radius
    height = middle[2] + away @ slope
    return replace(
        ground, height=np.where(near, height, np.nan),
        confidence=np.where(near, config.start_confidence, 0.0),
    )  # fmt: skip


def _unknown(
    x: tuple[float, float], y: tuple[float, float], time: float, config: CrossingConfig
) -> HeightMap:
    """A map of ranges of x and y (m, odometry frame) in which nothing is known."""
    region = Region.spanning(x, y, config.map.cell)
    return HeightMap(
        time=time, cell=config.map.cell, pose=region.pose, height=np.full((region.n, region.m), np.nan),
        confidence=np.zeros((region.n, region.m)),
    )  # fmt: skip


def shortened(route: Route, stretch: float) -> Route:
    """The first part of a route, `stretch` m of it; a little more where that makes it whole."""
    poses = route.poses
    if len(poses) < 2:
        return route
    along = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(poses[:, :2], axis=0).T))))
    if along[-1] <= 1.2 * stretch:
        return route
    return replace(route, poses=poses[: int(np.searchsorted(along, stretch)) + 1], reaches_goal=False)
