"""What goes into the gait, what comes out, and what it remembers."""

from __future__ import annotations

import copy
from dataclasses import dataclass, field

import numpy as np

from bluefoot_mpc.gait.calibration import Rhythm
from bluefoot_mpc.gait.cpg import CpgState
from bluefoot_mpc.gait.footholds import Foot
from bluefoot_mpc.gait.parameters import NO_STYLE, Parameters, Style
from bluefoot_mpc.gait.reflex import IDLE, ReflexOutput
from bluefoot_mpc.gait.virtual_robot import VirtualPose
from bluefoot_mpc.types import BoolArray, FloatArray, GaitPhase


@dataclass(frozen=True, kw_only=True, slots=True)
class GaitInputs:
    """What the gait needs on one tick.

    Attributes:
        velocity: (2,) m/s, forward and left, in the heading frame (b').
        yaw_rate: rad/s, left positive.
        gait: name of the wanted gait.
        contact: (4,) True where the foot touches.
        foot_position: (4, 3) m, estimated feet in b', or None when unknown.
        trunk_position: (3,) m, trunk origin in b'; its height is not used.
        tilt_rate_error: (2,) rad/s, estimated minus wanted angular velocity
            about x and y of b'.
        halt: True ends the gait at once: feet in the air land, then all rest.
        foothold_shift: (2,) m in b', shift of the places where feet in the air
            land (capture point); bounded, and followed at a limited speed.
        rough: True on ground whose steps are planned one by one (`Gait.plan_step`).
    """

    velocity: FloatArray = field(default_factory=lambda: np.zeros(2))
    yaw_rate: float = 0.0
    gait: str = "trot"
    contact: BoolArray = field(default_factory=lambda: np.ones(4, dtype=np.bool_))
    foot_position: FloatArray | None = None
    trunk_position: FloatArray = field(default_factory=lambda: np.zeros(3))
    tilt_rate_error: FloatArray = field(default_factory=lambda: np.zeros(2))
    halt: bool = False
    foothold_shift: FloatArray | None = None
    rough: bool = False


@dataclass(frozen=True, kw_only=True, slots=True)
class GaitOutput:
    """What the gait wants on one tick.

    Attributes:
        phase: swing states; `phase.swing` is False for a foot that landed early.
        foot_position: (4, 3) m in b', the frame of the virtual robot: origin on
            the ground under its centre, x along its heading.
        foot_height: (4,) m above the ground plane.
        swing_progress: (4,) share of the swing's time passed, 0 in stance.
        virtual_pose: (3,) x (m), y (m), yaw (rad) of b' in the world of the
            odometry start.
        velocity: (2,) m/s in b', the command after its ramp.
        yaw_rate: rad/s, after its ramp.
        cycle_time: s.
        swing_share: share of the cycle that a leg swings.
        style: what the gait's table says about the trunk, for later stages.
        place: place between the gaits, 0 trot, 1 walk.
        rough: True on ground whose steps are planned one by one.
    """

    phase: GaitPhase
    foot_position: FloatArray
    foot_height: FloatArray
    swing_progress: FloatArray
    virtual_pose: FloatArray
    velocity: FloatArray
    yaw_rate: float
    cycle_time: float
    swing_share: float
    style: Style = NO_STYLE
    place: float = 0.0
    rough: bool = False


@dataclass(kw_only=True, slots=True)
class GaitState:
    """Memory of the gait.

    Attributes:
        cpg: oscillators.
        pose: virtual robot.
        feet: one record a leg.
        place: place between the gaits, 0 trot, 1 walk.
        target: place of the wanted gait.
        wanted: commanded velocity, m/s in b'.
        wanted_yaw_rate: rad/s.
        velocity: the same after the ramp, m/s.
        yaw_rate: after the ramp, rad/s.
        walking: False when the network rests.
        landing: True while it comes to rest.
        idle: cycles on the spot since the command became zero.
        reflex: effect of the reflex on this tick.
        cycle: cycle time, s.
        rhythm: limit cycle in force.
        now: parameters at the present speed.
        read: place, velocity and yaw rate for which they were read.
        style: trunk parameters, following those of `now`.
        wanted_shift: wanted shift of landing places, m in b'.
        landing_shift: the shift in force.
        rough: True on ground whose steps are planned one by one.
    """

    cpg: CpgState
    rhythm: Rhythm
    pose: VirtualPose
    feet: list[Foot]
    now: Parameters
    style: Style
    place: float = 0.0
    target: float = 0.0
    wanted: complex = 0j
    wanted_yaw_rate: float = 0.0
    velocity: complex = 0j
    yaw_rate: float = 0.0
    walking: bool = False
    landing: bool = False
    idle: float = 0.0
    reflex: ReflexOutput = IDLE
    cycle: float = 1.0
    read: tuple[float, complex, float] | None = None
    wanted_shift: complex = 0j
    landing_shift: complex = 0j
    rough: bool = False

    def copy(self) -> GaitState:
        """An independent copy."""
        twin = copy.copy(self)
        twin.feet = [foot.copy() for foot in self.feet]
        return twin
