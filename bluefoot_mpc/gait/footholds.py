"""Foothold controller (paper, chapter 5): virtual footholds, swinging and standing feet.

Virtual footholds ride on the virtual robot. A standing foot keeps its place in
the world; a swinging one moves to its virtual foothold, by the paper's damped
point mass or along a minimum-jerk path. Planar vectors are complex numbers.
"""

from __future__ import annotations

import copy
import math
from dataclasses import dataclass
from typing import NamedTuple

from bluefoot_mpc.gait import stepping
from bluefoot_mpc.gait.foothold_config import FootholdConfig, SwingShape
from bluefoot_mpc.gait.swing import lift_profile, matched_step, smooth_step, spring_transition
from bluefoot_mpc.gait.virtual_robot import VirtualPose, carried, point_velocity

__all__ = [
    "Foot",
    "FootholdConfig",
    "LegClock",
    "Stride",
    "SwingShape",
    "advance_foot",
    "early_contact",
    "freeze",
    "virtual_foothold",
]


@dataclass(kw_only=True, slots=True)
class Foot:
    """Memory of one foot; owned by the gait.

    Attributes:
        nominal: place under the virtual robot, x + iy, m in b'.
        anchor: place in the world while standing, m.
        shape: how it swings, latched at lift-off.
        z: height above the ground plane now, m.
        local: place in b' while swinging, m.
        velocity: velocity in b' while swinging, m/s.
        start: place in b' at lift-off, m.
        start_z: height at lift-off, m.
        apex: step height latched at lift-off, m.
        offset: shift of the virtual foothold after a reset, m in b'.
        offset_z: the same in height, m.
        goal: foothold given from outside, world, m; None for the virtual one.
        goal_z: its height, m.
        top: highest point of a step over rough ground, m; None for a usual swing.
        later: foothold and height to take up at the next lift-off.
        turning: True while the leg's oscillator swings.
        swinging: True while the foot swings (False after an early landing).
        lost: True once contact was lost after lift-off.
    """

    nominal: complex
    anchor: complex
    shape: SwingShape
    z: float = 0.0
    local: complex = 0j
    velocity: complex = 0j
    start: complex = 0j
    start_z: float = 0.0
    apex: float = 0.0
    offset: complex = 0j
    offset_z: float = 0.0
    goal: complex | None = None
    goal_z: float = 0.0
    top: float | None = None
    later: tuple[complex, float] | None = None
    turning: bool = False
    swinging: bool = False
    lost: bool = False

    def copy(self) -> Foot:
        """An independent copy (all attributes are immutable values)."""
        return copy.copy(self)

    def in_b(self, pose: VirtualPose) -> complex:
        """Place in b', m."""
        return self.local if self.swinging else pose.to_local(self.anchor)


class Stride(NamedTuple):
    """What all feet share during one step.

    Attributes:
        before: virtual pose at the start of the step.
        after: virtual pose at its end.
        velocity: commanded velocity, m/s in b'.
        yaw_rate: rad/s.
        dt: s.
        swing_time: expected duration of a swing, s.
        stance_time: expected duration of a stance, s.
        height: step height for feet that lift now, m.
        apex_y2: y2 that counts as full height.
        shift: displacement of swinging feet by the reflex, m in b'.
        landing: shift of the places where they land, m in b'.
        shape: how feet that lift now swing.
    """

    before: VirtualPose
    after: VirtualPose
    velocity: complex
    yaw_rate: float
    dt: float
    swing_time: float
    stance_time: float
    height: float
    apex_y2: float
    shift: complex
    landing: complex
    shape: SwingShape


class LegClock(NamedTuple):
    """One leg's place in the cycle after the step.

    Attributes:
        swing: True while the oscillator swings.
        progress: share of the swing's or stance's time passed.
        y2: second oscillator state.
        lower: factor on the step height from the reflex.
    """

    swing: bool
    progress: float
    y2: float
    lower: float = 1.0


def virtual_foothold(foot: Foot, stride: Stride) -> complex:
    """Where the foot should land, in b': the nominal place carried ahead, plus both shifts."""
    ahead = foot.shape.stance_lead * stride.stance_time
    place = carried(foot.nominal, stride.velocity, stride.yaw_rate, ahead) + foot.offset
    return place + stride.landing if stride.landing else place


def advance_foot(foot: Foot, clock: LegClock, stride: Stride, config: FootholdConfig) -> None:
    """Move one foot through one step (changes `foot`)."""
    if foot.offset or foot.offset_z:
        keep = math.exp(-stride.dt / config.offset_time)
        foot.offset *= keep
        foot.offset_z *= keep
    if clock.swing and not foot.turning:
        _lift(foot, clock, stride)
    foot.turning = clock.swing
    if not foot.swinging:
        return
    if foot.top is not None and foot.goal is not None:
        _step_over(foot, foot.goal, clock, stride, config.stepping)
    elif foot.shape.law == "virtual_force":
        _pull(foot, stride, config)
        if not clock.swing:
            foot.anchor = stride.after.to_world(foot.local)
    else:
        _follow(foot, clock, stride)
    if not clock.swing:
        _land(foot)
    elif foot.top is None:
        foot.z = _height(foot, clock, stride)
    else:
        foot.z = stepping.height(clock.progress, foot.start_z, foot.top, foot.goal_z, config.stepping)


def early_contact(
    foot: Foot, contact: bool, progress: float, height: float | None, config: FootholdConfig
) -> bool:
    """Whether a swinging foot has landed early; arms itself once contact was lost (changes `foot`).

    Args:
        foot: the foot.
        contact: True where its switch is closed.
        progress: share of the swing's time passed.
        height: m, estimated height over the ground plane, or None if unknown.
        config: when a contact counts.
    """
    if not foot.swinging:
        return False
    if not contact:
        foot.lost = True
        return False
    high = height is None or height >= config.early_height
    return config.early_contact and foot.lost and high and progress >= config.early_progress


def freeze(
    foot: Foot, estimate: tuple[complex, float] | None, stride: Stride, config: FootholdConfig
) -> None:
    """Stop a foot that landed early and move its virtual foothold to where it is (changes `foot`).

    Args:
        foot: the foot, still swinging.
        estimate: estimated place (m in b') and height (m), or None if unknown.
        stride: the step in which it happened.
        config: bound of the shift.
    """
    foot.anchor = stride.after.to_world(foot.local)
    foot.velocity = 0j
    foot.swinging = False
    foot.goal = foot.top = None
    if estimate is None:
        return
    shift = estimate[0] - virtual_foothold(foot, stride) + foot.offset
    size = abs(shift)
    limit = config.offset_limit
    foot.offset = shift * (limit / size) if size > limit else shift
    foot.offset_z = min(limit, max(-limit, estimate[1]))


def _lift(foot: Foot, clock: LegClock, stride: Stride) -> None:
    """Start a swing at the moment inside the step at which y2 became positive."""
    foot.shape = stride.shape
    now = stride.after.to_local(foot.anchor)
    drift = point_velocity(now, stride.velocity, stride.yaw_rate)
    foot.start = now + drift * (clock.progress * stride.swing_time)
    foot.start_z = foot.z
    foot.local = stride.before.to_local(foot.anchor)
    foot.velocity = -drift
    foot.apex = stride.height
    foot.swinging = True
    foot.lost = False
    if foot.later is not None:
        foot.goal, foot.goal_z = foot.later
        foot.later = None


def _land(foot: Foot) -> None:
    """End a swing: the foot stands where it is."""
    foot.z = foot.goal_z if foot.goal is not None else foot.offset_z
    foot.goal = foot.top = None
    foot.velocity = 0j
    foot.swinging = False


def _step_over(
    foot: Foot, goal: complex, clock: LegClock, stride: Stride, config: stepping.SteppingConfig
) -> None:
    """From its place to its foothold, both fixed in the world."""
    share = stepping.across(clock.progress, config) if clock.swing else 1.0
    local = stride.after.to_local(foot.anchor + (goal - foot.anchor) * share)
    foot.velocity = (local - foot.local) / stride.dt
    foot.local = local
    if not clock.swing:
        foot.anchor = goal


def _goal(foot: Foot, pose: VirtualPose, stride: Stride) -> complex:
    if foot.goal is not None:
        return pose.to_local(foot.goal)
    return virtual_foothold(foot, stride)


def _pull(foot: Foot, stride: Stride, config: FootholdConfig) -> None:
    """Damped point mass, integrated exactly in the error to the foothold."""
    after = _goal(foot, stride.after, stride)
    # Only a foothold that is fixed in the world moves in b'.
    before = after if foot.goal is None else stride.before.to_local(foot.goal)
    drift = (after - before) / stride.dt
    rate = foot.shape.swing_rate / stride.swing_time
    a, b, c, d = spring_transition(rate, config.damping_ratio, stride.dt)
    rest = -stride.shift
    if config.ground_damping and foot.goal is None:
        over_ground = point_velocity(foot.local, stride.velocity, stride.yaw_rate)
        rest += 2.0 * config.damping_ratio / rate * over_ground
    error = before - foot.local - rest
    error_rate = drift - foot.velocity
    foot.local = after - rest - (a * error + b * error_rate)
    foot.velocity = drift - (c * error + d * error_rate)


def _follow(foot: Foot, clock: LegClock, stride: Stride) -> None:
    """Minimum-jerk path at the swing's progress; lands at the exact moment inside the step."""
    goal = _goal(foot, stride.after, stride)
    fixed = foot.goal is not None
    s = clock.progress if clock.swing else 1.0
    drift = point_velocity(goal, stride.velocity, stride.yaw_rate)
    if fixed:
        # A foothold fixed in the world: start and goal both drift through b' already.
        start = stride.after.to_local(foot.anchor)
        local = matched_step(start, goal, 0j, s)
    else:
        local = matched_step(foot.start, goal, foot.shape.ground_matching * drift * stride.swing_time, s)
        if not clock.swing:
            local -= drift * (clock.progress * stride.stance_time)
    foot.velocity = (local - foot.local) / stride.dt
    foot.local = local
    if not clock.swing:
        foot.anchor = stride.after.to_world(local)


def _height(foot: Foot, clock: LegClock, stride: Stride) -> float:
    goal_z = foot.goal_z if foot.goal is not None else foot.offset_z
    base = foot.start_z + (goal_z - foot.start_z) * smooth_step(clock.progress)
    if foot.shape.vertical == "sine":
        return base + foot.apex * max(clock.y2, 0.0) / stride.apex_y2
    return base + foot.apex * clock.lower * lift_profile(clock.progress, foot.shape.apex)
