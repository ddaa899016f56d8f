"""A flat test bench: a robot that glides over the floor of a world plan, its LIDAR and its odometry.

Thousands of seconds of closed loop in seconds. The robot follows its command with
the gait's ramps and a lag, its odometry drifts, its LIDAR has the figures of the
simulator's. What it has in common with the walking robot is the outline.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from bluefoot_mpc.io.lidar.geometry import bearings
from bluefoot_mpc.model.parameters import SensorMounts
from bluefoot_mpc.navigation.navigator import Decision, Navigator
from bluefoot_mpc.navigation.outline import OutlineConfig, distances
from bluefoot_mpc.navigation.pose import Pose
from bluefoot_mpc.sim.worlds import footprint
from bluefoot_mpc.sim.worlds.coverage import LIDAR_HEIGHT, Coverage, reachable
from bluefoot_mpc.sim.worlds.plan import Solid, WorldPlan
from bluefoot_mpc.types import BodyState, FloatArray, Guide, ImuBatch, LidarScan, SensorFrame

MOUNTS = SensorMounts(imu=(0.0, 0.0, 0.02), lidar=(0.04, 0.0, 0.127), camera=(0.105, 0.0, 0.07))
HEIGHT = 0.115
"""m, trunk above the feet."""
PERIOD = 0.02
SWEEP_TICKS = 5
ORIGIN = Pose(0.0, 0.0, 0.0)
BEARINGS = bearings()


def box(name: str, x: float, y: float, length: float, width: float) -> Solid:
    """A thing of half a metre's height."""
    return Solid(name=name, shape="box", x=x, y=y, z=0.25, size=(length, width, 0.5))


def closed_room(*things: Solid) -> WorldPlan:
    """Five by four metres, the origin near one end."""
    walls = (
        box("back", -1.05, 0.0, 0.1, 4.0), box("front", 4.05, 0.0, 0.1, 4.0),
        box("right", 1.5, -2.05, 5.2, 0.1), box("left", 1.5, 2.05, 5.2, 0.1),
    )  # fmt: skip
    return WorldPlan(name="room", seed=0, bounds=(-1.0, -2.0, 4.0, 2.0), solids=(*walls, *things))


class FlatWorld:
    """Walls and things of a plan, cut at the LIDAR's height.

    Args:
        plan: of the world.
    """

    def __init__(self, plan: WorldPlan) -> None:
        self.plan = plan
        cut = footprint.crossing(plan.solids, LIDAR_HEIGHT)
        self._boxes = _table([s for s in cut if s.shape == "box"])
        self._rounds = _table([s for s in cut if s.shape == "cylinder"])
        solids = footprint.in_the_way(plan.solids)
        self._edge = np.concatenate([footprint.outline(s) for s in solids]) if solids else np.zeros((0, 2))

    def ranges(self, x: float, y: float, angles: FloatArray) -> FloatArray:
        """(n,) m to what rays from a point meet; infinite in the open."""
        ray = np.stack((np.cos(angles), np.sin(angles)), axis=-1)[:, None]
        least = np.full(angles.size, np.inf)
        if len(self._boxes):
            least = np.minimum(least, self._to_boxes(x, y, ray).min(axis=1))
        if len(self._rounds):
            least = np.minimum(least, self._to_rounds(x, y, ray).min(axis=1))
        return least

    def clearance(self, pose: Pose, outline: OutlineConfig) -> float:
        """m from the robot's outline to the nearest edge."""
        near = self._edge[np.hypot(self._edge[:, 0] - pose.x, self._edge[:, 1] - pose.y) < 1.5]
        return float(distances(pose.to_robot(near), outline).min(initial=np.inf))

    def _to_boxes(self, x: float, y: float, ray: FloatArray) -> FloatArray:
        boxes = self._boxes
        cos, sin = np.cos(boxes[:, 4]), np.sin(boxes[:, 4])
        dx, dy = x - boxes[:, 0], y - boxes[:, 1]
        enter, leave = np.full((1, 1), -np.inf), np.full((1, 1), np.inf)
        for share, start, half in (
            (ray[..., 0] * cos + ray[..., 1] * sin, dx * cos + dy * sin, 0.5 * boxes[:, 2]),
            (ray[..., 1] * cos - ray[..., 0] * sin, dy * cos - dx * sin, 0.5 * boxes[:, 3]),
        ):
            along = np.where(np.abs(share) < 1e-12, 1e-12, share)
            one, other = (-half - start) / along, (half - start) / along
            enter = np.maximum(enter, np.minimum(one, other))
            leave = np.minimum(leave, np.maximum(one, other))
        return np.where((enter < leave) & (leave > 0.0), np.maximum(enter, 0.0), np.inf)

    def _to_rounds(self, x: float, y: float, ray: FloatArray) -> FloatArray:
        rounds = self._rounds
        dx, dy = rounds[:, 0] - x, rounds[:, 1] - y
        along = ray[..., 0] * dx + ray[..., 1] * dy
        inner = (0.5 * rounds[:, 2]) ** 2 - (dx * dx + dy * dy - along * along)
        hit = (inner > 0.0) & (along > 0.0)
        return np.where(hit, along - np.sqrt(np.maximum(inner, 0.0)), np.inf)


@dataclass(kw_only=True)
class FlatRobot:
    """A body that glides as the gait walks: ramps, a lag, and odometry that drifts."""

    rng: np.random.Generator
    pose: Pose = ORIGIN
    odometry: Pose = ORIGIN
    acceleration: float = 0.1  # m/s²
    yaw_acceleration: float = 1.0  # rad/s²
    lag: float = 0.25  # s
    scale: float = 0.02  # odometry's error per metre
    yaw_drift: float = 0.003  # rad/s while it moves
    gait: FloatArray = field(default_factory=lambda: np.zeros(3))
    twist: FloatArray = field(default_factory=lambda: np.zeros(3))

    def step(self, wanted: FloatArray, dt: float) -> None:
        """Glide for `dt` seconds."""
        ramp = np.array((self.acceleration, self.acceleration, self.yaw_acceleration)) * dt
        self.gait = self.gait + np.clip(wanted - self.gait, -ramp, ramp)
        self.twist = self.twist + dt / self.lag * (self.gait - self.twist)
        moving = bool(np.abs(self.twist).max() > 1e-3)
        noise = self.rng.normal(0.0, (0.01, 0.01, 0.01)) if moving else np.zeros(3)
        self.pose = _moved(self.pose, self.twist + noise, dt)
        felt = self.twist * (1.0 + self.scale) + (0.0, 0.0, self.yaw_drift if moving else 0.0)
        self.odometry = _moved(self.odometry, felt, dt)

    def estimate(self, time: float) -> BodyState:
        """What the robot believes."""
        x, y, yaw = self.odometry
        return body_state(time, x, y, yaw, velocity=self.twist)


@dataclass(kw_only=True)
class Ride:
    """What a closed loop gave.

    Attributes:
        clearance: m, least distance of the outline to a thing.
        seen: share of the reachable floor that the LIDAR saw.
        travelled: m.
        still: s, longest time without 5 cm or 10 degrees of motion.
        path: (n, 3) true poses, ten a second.
        decisions: of the ticks with a sweep.
    """

    clearance: float = math.inf
    seen: float = 0.0
    travelled: float = 0.0
    still: float = 0.0
    path: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))
    decisions: list[Decision] = field(default_factory=list)
    near: tuple[float, Pose] = (0.0, ORIGIN)


class Bench:
    """A world, a robot in it, and what leads it.

    Args:
        plan: of the world.
        navigator: what leads.
        seed: of all errors.
        start: pose of the robot at first.
    """

    def __init__(self, plan: WorldPlan, navigator: Navigator, seed: int = 0, start: Pose = ORIGIN) -> None:
        self.world = FlatWorld(plan)
        self.navigator = navigator
        self.rng = np.random.default_rng(seed)
        self.robot = FlatRobot(
            rng=self.rng, pose=start, scale=self.rng.uniform(-0.02, 0.02),
            yaw_drift=self.rng.uniform(-0.004, 0.004),
        )  # fmt: skip
        self.outline = OutlineConfig()
        self.grid = reachable(plan)
        self.coverage = Coverage(self.grid)
        self.ticks = 0

    def scan(self, time: float) -> LidarScan:
        """A sweep from where the robot is."""
        x, y, yaw = self.lidar_pose()
        jitter = self.rng.normal(0.0, math.radians(0.05), BEARINGS.size)
        true = self.world.ranges(x, y, BEARINGS + yaw + jitter)
        noise = np.where(true < 1.0, 0.010, 0.01 * np.minimum(true, 6.0))
        distance = true + noise * self.rng.normal(size=true.size)
        distance[(true > 5.6) | (self.rng.random(true.size) < 0.005)] = np.nan
        return LidarScan(time=time, bearing=BEARINGS, distance=distance, valid=True)

    def lidar_pose(self) -> FloatArray:
        """(3,) of the LIDAR in world."""
        x, y, yaw = self.robot.pose
        forward = MOUNTS.lidar[0]
        return np.array((x + forward * math.cos(yaw), y + forward * math.sin(yaw), yaw))

    def ride(self, guide: Guide, duration: float) -> Ride:
        """Let the robot find its way for a while."""
        ride, poses = Ride(), [self.robot.pose]
        for _ in range(round(duration / PERIOD)):
            time = self.ticks * PERIOD
            scan = self.scan(time) if self.ticks % SWEEP_TICKS == 0 else None
            decision = self.navigator.step(guide, sensor_frame(time, scan), self.robot.estimate(time), PERIOD)
            self.robot.step(np.array((*decision.velocity, decision.yaw_rate)), PERIOD)
            self.ticks += 1
            if scan is not None:
                self.coverage.add(self.lidar_pose(), scan)
                clearance = self.world.clearance(self.robot.pose, self.outline)
                if clearance < ride.clearance:
                    ride.clearance, ride.near = clearance, (time, self.robot.pose)
                poses.append(self.robot.pose)
                ride.decisions.append(decision)
        ride.path = np.array(poses)
        ride.seen = self.coverage.fraction
        ride.travelled = float(np.hypot(*np.diff(ride.path[:, :2], axis=0).T).sum())
        ride.still = longest_rest(ride.path)
        return ride


def longest_rest(path: FloatArray, step: float = 0.1) -> float:
    """s, longest time in which (n, 3) poses stay within 5 cm and 10 degrees."""
    longest, start = 0, 0
    for now in range(len(path)):
        apart = path[start : now + 1] - path[now]
        turn = np.abs((apart[:, 2] + np.pi) % (2.0 * np.pi) - np.pi)
        moved = np.flatnonzero((np.hypot(apart[:, 0], apart[:, 1]) > 0.05) | (turn > math.radians(10.0)))
        if moved.size:
            start += int(moved[-1]) + 1
        longest = max(longest, now - start)
    return longest * step


def body_state(
    time: float, x: float = 0.0, y: float = 0.0, yaw: float = 0.0, *,
    tilt: Sequence[float] = (0.0, 0.0), velocity: FloatArray | None = None,
) -> BodyState:  # fmt: skip
    """An estimate of a robot that stands or glides."""
    vx, vy, turn = np.zeros(3) if velocity is None else velocity
    return BodyState(
        time=time, position=np.array((x, y, HEIGHT)), quaternion=np.array((0.0, 0.0, 0.0, 1.0)),
        rpy=np.array((tilt[0], tilt[1], yaw)), linear_velocity=np.array((vx, vy, 0.0)),
        angular_velocity=np.array((0.0, 0.0, turn)), joint_position=np.zeros(16),
        joint_velocity=np.zeros(16), contact=np.ones(4, dtype=bool),
        foot_position_in_base=np.zeros((4, 3)), height=HEIGHT,
    )  # fmt: skip


def sensor_frame(time: float, scan: LidarScan | None = None) -> SensorFrame:
    """A frame that holds a sweep, or none."""
    none = np.zeros((0, 3))
    return SensorFrame(
        time=time, joint_position=np.zeros(16), joint_speed=np.zeros(16), joint_load=np.zeros(16),
        joint_temperature=np.full(16, 25.0), joint_time=np.zeros(16), joint_valid=np.ones(16, dtype=bool),
        voltage=12.0, voltage_valid=True,
        imu=ImuBatch(time=np.zeros(0), gyro=none, accel=none, magnetometer=none, valid=np.zeros(0, bool)),
        contact=np.ones(4, dtype=bool), contact_time=np.zeros(4), contact_valid=np.ones(4, dtype=bool),
        lidar=scan,
    )  # fmt: skip


def _moved(pose: Pose, twist: FloatArray, dt: float) -> Pose:
    vx, vy, turn = twist.tolist()
    yaw = pose.yaw + 0.5 * turn * dt
    return Pose(
        pose.x + (math.cos(yaw) * vx - math.sin(yaw) * vy) * dt,
        pose.y + (math.sin(yaw) * vx + math.cos(yaw) * vy) * dt,
        pose.yaw + turn * dt,
    )


def _table(solids: Sequence[Solid]) -> FloatArray:
    """(n, 5) centre, size and yaw of solids."""
    return np.array([(s.x, s.y, s.size[0], s.size[1], s.yaw) for s in solids]).reshape(-1, 5)
