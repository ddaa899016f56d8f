"""Batteries of the paper's laws: what the robot reaches with ``--controller cpg``."""

from __future__ import annotations

from bluefoot_mpc.evaluation.cases import Case
from bluefoot_mpc.evaluation.limits import Limit

NO_FALL = Limit(figure="falls", bound=0)
SPEED = Limit(figure="speed_error_percent", bound=10.0, unit="%")
DRIFT = Limit(figure="drift_percent", bound=10.0, unit="%")
CLEARANCE = Limit(figure="clearance_mm", bound=8.0, side="min", unit="mm")


def _tilt(bound: float) -> tuple[Limit, Limit]:
    return (
        Limit(figure="roll_rms_deg", bound=bound, unit="°"),
        Limit(figure="pitch_rms_deg", bound=bound, unit="°"),
    )


def walking_cases(seeds: tuple[int, ...] = tuple(range(10)), duration: float = 60.0) -> tuple[Case, ...]:
    """Straight walking at every stated speed, both gaits."""
    bars = {
        ("trot", 0.04): 1.0, ("trot", 0.06): 1.0, ("trot", 0.08): 1.5, ("trot", 0.10): 1.5,
        ("walk", 0.03): 2.0, ("walk", 0.04): 2.0, ("walk", 0.06): None,
    }  # fmt: skip
    common = (NO_FALL, SPEED, DRIFT, CLEARANCE)
    return tuple(
        Case(
            name=f"{gait} {1e3 * speed:.0f} mm/s",
            scenario="walk",
            options={"controller": "cpg", "gait": gait, "speed": speed, "duration": duration},
            seeds=seeds,
            limits=common if tilt is None else (*common, *_tilt(tilt)),
        )
        for (gait, speed), tilt in bars.items()
    )


def estimation_cases(seeds: tuple[int, ...] = tuple(range(10)), duration: float = 60.0) -> tuple[Case, ...]:
    """What the estimator must reach, from rest, walking fast and turning."""
    limits = (
        NO_FALL,
        Limit(figure="attitude_error_deg", bound=0.3, unit="°"),
        Limit(figure="odometry_error_percent", bound=5.0, unit="%"),
    )
    runs = {"straight, 100 mm/s": ("walk", 0.0), "turning 0.3 rad/s, 100 mm/s": ("turn", 0.3)}
    return tuple(
        Case(
            name=f"estimate, {name}",
            scenario=scenario,
            options={"controller": "cpg", "speed": 0.1, "yaw_rate": yaw_rate, "duration": duration},
            seeds=seeds,
            limits=limits,
        )
        for name, (scenario, yaw_rate) in runs.items()
    )


def push_cases(seeds: tuple[int, ...] = tuple(range(10)), directions: int = 8) -> tuple[Case, ...]:
    """Pushes of 2 N·s over 0.1 s, standing and in a trot; the push falls on another phase with each seed."""
    return tuple(
        Case(
            name=f"push 2 N·s to {360.0 * k / directions:.0f}°, {what}",
            scenario="push",
            options={
                "controller": "cpg",
                "speed": speed,
                "impulse": 2.0,
                "direction": 360.0 * k / directions,
                "duration": 10.0,
            },
            seeds=seeds,
            limits=(NO_FALL,),
        )
        for what, speed in (("standing", 0.0), ("trot 60 mm/s", 0.06))
        for k in range(directions)
    )


def transition_cases(seeds: tuple[int, ...] = tuple(range(10))) -> tuple[Case, ...]:
    """Trot to walk to trot; the change falls on another phase with each seed."""
    return (
        Case(
            name="trot - walk - trot at 40 mm/s",
            scenario="transition",
            options={"controller": "cpg", "speed": 0.04, "duration": 30.0},
            seeds=seeds,
            limits=(NO_FALL, *_tilt(2.0)),
        ),
    )


def other_robot_cases(seeds: tuple[int, ...] = tuple(range(3))) -> tuple[Case, ...]:
    """A robot 20 % larger walks with the same code."""
    return (
        Case(
            name="20 % larger robot, trot 60 mm/s",
            scenario="walk",
            options={"controller": "cpg", "model": "bluefoot_large", "speed": 0.06, "duration": 30.0},
            seeds=seeds,
            limits=(NO_FALL, SPEED, DRIFT, *_tilt(1.0)),
        ),
    )


def robustness_cases(seeds: tuple[int, ...] = tuple(range(10))) -> tuple[Case, ...]:
    """Randomised robots, as deployment will meet them; reported, no bar but standing."""
    return (
        Case(
            name="trot 60 mm/s, randomised robot",
            scenario="walk",
            options={"controller": "cpg", "speed": 0.06, "duration": 60.0, "randomize": "standard"},
            seeds=seeds,
            limits=(NO_FALL,),
        ),
    )
