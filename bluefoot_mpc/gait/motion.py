"""Planned feet with velocity and acceleration, now or a little ahead.

All in axes of b' at the asked moment. Velocities and accelerations are over the
ground, the virtual world in which standing feet rest: those in b' plus what its
own motion (constant twist) adds. Planar vectors are complex numbers, x + iy.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bluefoot_mpc.gait.ahead import leg_phases
from bluefoot_mpc.gait.calibration import TABLE, Rhythm
from bluefoot_mpc.gait.footholds import Foot, FootholdConfig
from bluefoot_mpc.gait.state import GaitState
from bluefoot_mpc.gait.swing import lift_motion, smooth_bend, smooth_slope, smooth_step, spring_transition
from bluefoot_mpc.gait.virtual_robot import VirtualPose, carried, point_velocity
from bluefoot_mpc.types import BoolArray, FloatArray

_STEP = 0.03  # of a swing's progress: for the sine profile's derivatives, wider than its table's kinks
_REST = (0.0,) * 6


@dataclass(frozen=True, kw_only=True, slots=True)
class FootMotion:
    """The planned feet at one moment.

    Attributes:
        position: (4, 3) m in b' of that moment.
        velocity: (4, 3) m/s over the ground, axes of b'; zero for standing feet.
        acceleration: (4, 3) m/s² over the ground, axes of b'; zero for standing feet.
        swing: (4,) True where the foot is in the air.
        virtual_pose: (3,) x (m), y (m), yaw (rad) of b' in the world of the odometry start.
    """

    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    swing: BoolArray
    virtual_pose: FloatArray


class _Pace(NamedTuple):
    """What all feet share: b' before and after the lead, its twist, and the swing's timing.

    Attributes:
        before: b' now, or at lift-off if that is later.
        pose: b' after the lead.
        velocity: m/s in b'.
        yaw_rate: rad/s.
        lead: s from `before` to `pose`.
        swing_time: s.
        stance_time: s.
        rhythm: limit cycle in force.
        landing: shift of landing places, m in b'.
    """

    before: VirtualPose
    pose: VirtualPose
    velocity: complex
    yaw_rate: float
    lead: float
    swing_time: float
    stance_time: float
    rhythm: Rhythm
    landing: complex


# place, velocity and acceleration in b' (x + iy), then height with its two derivatives
_Point = tuple[complex, complex, complex, float, float, float]


def feet_ahead(state: GaitState, lead: float, config: FootholdConfig) -> FootMotion:
    """Planned feet after `lead` seconds of the present twist, at the present rhythm.

    Args:
        state: the gait now; untouched.
        lead: s, at most a swing or a stance; reflexes, ramps and changes of the
            rhythm within it are not foreseen.
        config: how feet swing.
    """
    rhythm, cycle = state.rhythm, state.cycle
    velocity, yaw_rate = (state.velocity, state.yaw_rate) if state.walking else (0j, 0.0)
    pace = _Pace(
        before=state.pose,
        pose=state.pose.moved(velocity, yaw_rate, lead) if lead else state.pose,
        velocity=velocity, yaw_rate=yaw_rate, lead=lead,
        swing_time=rhythm.share * cycle, stance_time=(1.0 - rhythm.share) * cycle,
        rhythm=rhythm, landing=state.landing_shift,
    )  # fmt: skip
    spin = complex(0.0, yaw_rate)
    rows: list[float] = []
    swing: list[bool] = []
    for foot, phase in zip(state.feet, leg_phases(state), strict=True):
        point = _foot(foot, phase, pace, state, config) if state.walking else None
        swing.append(point is not None)
        if point is None:
            place = pace.pose.to_local(_landed(foot, phase, pace) if foot.swinging else foot.anchor)
            rows += (place.real, place.imag, _goal_z(foot) if foot.swinging else foot.z, *_REST)
            continue
        place, rate, change, z, z_rate, z_change = point
        over = point_velocity(place, velocity, yaw_rate)
        speed, bend = rate + over, change + spin * (2.0 * rate + over)
        rows += (place.real, place.imag, z, speed.real, speed.imag, z_rate, bend.real, bend.imag, z_change)
    values = np.array(rows).reshape(4, 3, 3)
    centre, yaw = pace.pose
    return FootMotion(
        position=values[:, 0],
        velocity=values[:, 1],
        acceleration=values[:, 2],
        swing=np.array(swing),
        virtual_pose=np.array((centre.real, centre.imag, yaw)),
    )


def _foot(foot: Foot, phase: float, pace: _Pace, state: GaitState, config: FootholdConfig) -> _Point | None:
    """A foot that is in the air after the lead; None where it stands."""
    if foot.swinging:
        passed = phase / pace.rhythm.share
        progress = passed + pace.lead / pace.swing_time
        return _swinging(foot, passed, progress, pace, config) if progress < 1.0 else None
    wait = (1.0 - phase) * (pace.swing_time + pace.stance_time)
    if foot.turning or state.landing or pace.lead <= wait:
        return None
    # It lifts within the lead.
    lift = state.pose.moved(pace.velocity, pace.yaw_rate, wait)
    foot = _lifted(foot, lift, pace, state)
    pace = pace._replace(before=lift, lead=pace.lead - wait)
    return _swinging(foot, 0.0, pace.lead / pace.swing_time, pace, config)


def _lifted(foot: Foot, lift: VirtualPose, pace: _Pace, state: GaitState) -> Foot:
    """A copy of a standing foot at the moment at which it lifts."""
    fresh = foot.copy()
    fresh.shape, fresh.start_z, fresh.apex = state.now.shape, foot.z, state.now.step_height
    fresh.start = fresh.local = lift.to_local(foot.anchor)
    fresh.velocity = -point_velocity(fresh.start, pace.velocity, pace.yaw_rate)
    fresh.swinging = True
    if foot.top is None and foot.later is not None:
        fresh.goal, fresh.goal_z = foot.later
    return fresh


def _virtual_goal(foot: Foot, pace: _Pace) -> complex:
    ahead = foot.shape.stance_lead * pace.stance_time
    return carried(foot.nominal, pace.velocity, pace.yaw_rate, ahead) + foot.offset + pace.landing


def _goal_z(foot: Foot) -> float:
    return foot.goal_z if foot.goal is not None else foot.offset_z


def _landed(foot: Foot, phase: float, pace: _Pace) -> complex:
    """Where a foot that lands within the lead stands then, in the world, m."""
    if foot.goal is not None:
        return foot.goal
    since = pace.lead - (1.0 - phase / pace.rhythm.share) * pace.swing_time
    return pace.pose.moved(pace.velocity, pace.yaw_rate, -since).to_world(_virtual_goal(foot, pace))


def _swinging(foot: Foot, passed: float, s: float, pace: _Pace, config: FootholdConfig) -> _Point:
    """A foot at progress `s` of its swing, of which `passed` is over now."""
    planar = _pulled(foot, pace, config) if foot.shape.law == "virtual_force" else _followed(foot, s, pace)
    height = _height(foot, s, pace)
    # Heights count from the present one, in which a reflex may have had its part.
    z = foot.z + height[0] - (_height(foot, passed, pace)[0] if passed > 0.0 else foot.start_z)
    return (*planar, z, height[1], height[2])


def _followed(foot: Foot, s: float, pace: _Pace) -> tuple[complex, complex, complex]:
    """The minimum-jerk law: place in b', its rate and its change of rate there."""
    time = pace.swing_time
    smooth, slope, bend = smooth_step(s), smooth_slope(s), smooth_bend(s)
    if foot.goal is not None:
        # Both ends rest in the world, and drift through b' as it moves.
        start = pace.pose.to_local(foot.anchor)
        way = pace.pose.to_local(foot.goal) - start
        place = start + way * smooth
        over = point_velocity(place, pace.velocity, pace.yaw_rate)
        rate = way * slope / time - over
        return place, rate, way * bend / (time * time) - complex(0.0, pace.yaw_rate) * (2.0 * rate + over)
    goal = _virtual_goal(foot, pace)
    way = goal - foot.start
    drift = foot.shape.ground_matching * point_velocity(goal, pace.velocity, pace.yaw_rate) * time
    place = foot.start + way * smooth + drift * (smooth - s)
    return place, (way * slope + drift * (slope - 1.0)) / time, (way + drift) * bend / (time * time)


def _pulled(foot: Foot, pace: _Pace, config: FootholdConfig) -> tuple[complex, complex, complex]:
    """The paper's law: place in b', its rate and its change of rate there."""
    rate, ratio = foot.shape.swing_rate / pace.swing_time, config.damping_ratio
    rest = drift = 0j
    if foot.goal is None:
        before = after = _virtual_goal(foot, pace)
        if config.ground_damping:
            rest = 2.0 * ratio / rate * point_velocity(foot.local, pace.velocity, pace.yaw_rate)
    else:
        before, after = pace.before.to_local(foot.goal), pace.pose.to_local(foot.goal)
        drift = -point_velocity(after, pace.velocity, pace.yaw_rate)
    a, b, c, d = spring_transition(rate, ratio, pace.lead)
    error, error_rate = before - foot.local - rest, drift - foot.velocity
    error, error_rate = a * error + b * error_rate, c * error + d * error_rate
    return after - rest - error, drift - error_rate, rate * rate * error + 2.0 * ratio * rate * error_rate


def _height(foot: Foot, s: float, pace: _Pace) -> tuple[float, float, float]:
    """Height of a swing at progress `s`, m, with its derivatives in time."""
    time = pace.swing_time
    if foot.shape.vertical == "sine":
        low, mid, high = (_arch(pace.rhythm, s + step) for step in (-_STEP, 0.0, _STEP))
        lift = (mid, (high - low) / (2.0 * _STEP), (high - 2.0 * mid + low) / (_STEP * _STEP))
    else:
        lift = lift_motion(s, foot.shape.apex)
    rise = _goal_z(foot) - foot.start_z
    z = foot.start_z + rise * smooth_step(s) + foot.apex * lift[0]
    z_rate = (rise * smooth_slope(s) + foot.apex * lift[1]) / time
    return z, z_rate, (rise * smooth_bend(s) + foot.apex * lift[2]) / (time * time)


def _arch(rhythm: Rhythm, s: float) -> float:
    """y2 over its largest value at progress `s` of a swing, on a round limit cycle."""
    times = rhythm.swing_time
    k = 1
    while k < TABLE and s > times[k]:
        k += 1
    share = (k - 1 + (s - times[k - 1]) / (times[k] - times[k - 1])) / TABLE
    return math.sin(math.pi * share)
