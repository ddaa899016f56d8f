"""Weights, gains and limits of the whole-body controller."""

from __future__ import annotations

from dataclasses import dataclass, field

from bluefoot_mpc.exceptions import UnknownNameError
from bluefoot_mpc.qp import SOLVERS
from bluefoot_mpc.settings import require_nonnegative, require_positive, require_range

Triple = tuple[float, float, float]


@dataclass(frozen=True, kw_only=True, slots=True)
class WholeBodyWeights:
    """Cost of a squared error of each task, against that of a standing foot's slip.

    The spread between the largest and the smallest is the problem's condition:
    beyond 1e7 or so first-order and interior solvers lose digits of the torque.
    """

    contact: float = 1.0  # per (m/s²)², slip of a standing foot
    com: Triple = (0.3, 0.3, 0.3)  # per (m/s²)², world x, y, z
    trunk: Triple = (0.1, 0.1, 0.1)  # per (rad/s²)², world x, y, z
    momentum: Triple = (0.0, 0.0, 0.0)  # per (rad/s²)², rate of angular momentum over nominal inertia
    swing: float = 0.3  # per (m/s²)², swing foot
    posture: float = 1e-5  # per (rad/s²)², every joint
    force: float = 0.05  # per (share of the weight that a foot carries)², away from an even share

    def __post_init__(self) -> None:
        for name in ("com", "trunk", "momentum"):
            require_nonnegative(**{f"{name}[{i}]": value for i, value in enumerate(getattr(self, name))})
        # Posture and force make the problem strictly convex: they may be small, never zero.
        require_positive(contact=self.contact, posture=self.posture, force=self.force)
        require_nonnegative(swing=self.swing)


@dataclass(frozen=True, kw_only=True, slots=True)
class WholeBodyGains:
    """Feedback of each task: acceleration per error (1/s²) and per error of the velocity (1/s)."""

    com: tuple[float, float] = (100.0, 20.0)
    trunk: tuple[float, float] = (150.0, 25.0)
    momentum: float = 5.0  # 1/s
    contact: float = 10.0  # 1/s, brakes a standing foot that moves
    swing: tuple[float, float] = (300.0, 35.0)
    posture: tuple[float, float] = (100.0, 20.0)

    def __post_init__(self) -> None:
        for name in ("com", "trunk", "swing", "posture"):
            position, velocity = getattr(self, name)
            require_nonnegative(**{f"{name}[0]": position, f"{name}[1]": velocity})
        require_nonnegative(momentum=self.momentum, contact=self.contact)


@dataclass(frozen=True, kw_only=True, slots=True)
class WholeBodyConfig:
    """Everything that may be chosen about the whole-body controller."""

    weights: WholeBodyWeights = field(default_factory=WholeBodyWeights)
    gains: WholeBodyGains = field(default_factory=WholeBodyGains)
    solver: str = "daqp"  # a name of qp.SOLVERS
    free_first: bool = True  # try the optimum without limits first: mostly it keeps them, and costs a tenth
    friction: float = 0.5  # coefficient that the friction pyramids assume
    force_limit: float = 2.0  # of the robot's weight, largest normal force of a foot
    force_ramp: float = (
        0.04  # s, in which a foot takes its load after touch-down and gives it up before lift-off
    )
    torque_share: float = 1.0  # of the torque envelope that may be planned
    speed_share: float = 1.0  # of the joints' highest speed
    joint_margin: float = 0.0  # rad, kept from the position limits
    joint_acceleration: float = 400.0  # rad/s², largest planned, and what braking before a limit relies on
    limit_horizon: float = 1.0  # ticks over which position and speed limits must hold
    shift_time: float = 0.1  # s for which the previous plan stands in for one that failed
    stance_time: float = 0.5  # s of static stance without a plan, after which the robot asks to sit
    codegen: bool = True  # generate and build C where a compiler exists

    def __post_init__(self) -> None:
        if self.solver not in SOLVERS:
            raise UnknownNameError("solver", self.solver, SOLVERS)
        require_positive(
            friction=self.friction, force_limit=self.force_limit, limit_horizon=self.limit_horizon,
            joint_acceleration=self.joint_acceleration,
        )  # fmt: skip
        require_nonnegative(
            force_ramp=self.force_ramp, joint_margin=self.joint_margin, shift_time=self.shift_time,
            stance_time=self.stance_time,
        )  # fmt: skip
        require_range(0.01, 1.0, torque_share=self.torque_share, speed_share=self.speed_share)
