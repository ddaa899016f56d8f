"""Batteries of model-based control: randomised robots, flat floor and where a model has to earn its place.

Every function takes the controller, so that two controllers meet the same runs.
"""

from __future__ import annotations

from typing import Any

from bluefoot_mpc.evaluation.cases import Case
from bluefoot_mpc.evaluation.limits import Limit

SEEDS = tuple(range(20))
DIRECTIONS = 12
NO_FALL = Limit(figure="falls", bound=0)
HARDLY_A_FALL = Limit(figure="falls", bound=0, over="share", share=0.95)
"""At most one of twenty runs may end on the ground."""
ESTIMATE = (
    Limit(figure="attitude_bias_deg", bound=0.15, unit="°"),
    Limit(figure="attitude_error_deg", bound=0.25, unit="°"),
)
TRACKED = Limit(figure="speed_error_percent", bound=10.0, unit="%")
TROT_BARS = {
    0.06: (0.25, 0.25, 0.5, 10.0), 0.10: (0.25, 0.30, 0.5, 10.0), 0.20: (0.35, 0.45, 0.8, 8.0),
    0.30: (0.60, 0.80, 1.5, 6.0), 0.40: (1.00, 1.30, 2.2, 6.0),
}  # fmt: skip
"""By speed (m/s): median of roll and of pitch RMS, worst seed of either (degrees), clearance (mm)."""
TROT_SPEEDS: dict[float, tuple[Limit, ...]] = {
    0.30: (Limit(figure="speed_mmps", bound=285.0, side="min", unit="mm/s", over="median"),),
    0.40: (
        Limit(figure="speed_mmps", bound=360.0, side="min", unit="mm/s", over="median"),
        Limit(figure="speed_mmps", bound=320.0, side="min", unit="mm/s"),
    ),
}
"""By speed (m/s): what must be reached where that is not ± 5 % of the command on every seed."""
PAYLOAD = (0.2, 0.04, 0.03, 0.05)
"""kg on the trunk, and where (m): in front of the centre, to its left, above."""
REDUCTIONS = {
    "walk 30 mm/s": 0.40, "payload 0.2 kg": 0.30, "slope +8°": 0.30, "slope -8°": 0.30,
    "steps of 10 mm": 0.30, "friction 0.4": 0.30,
}  # fmt: skip
"""By case: the least part by which the tilt must lie under that of the paper's laws."""


def tilt_limits(roll: float, pitch: float, worst: float) -> tuple[Limit, ...]:
    """Bounds on the RMS of roll and pitch, degrees: of the median seed, and of the worst."""
    return (
        Limit(figure="roll_rms_deg", bound=roll, unit="°", over="median"),
        Limit(figure="pitch_rms_deg", bound=pitch, unit="°", over="median"),
        Limit(figure="roll_rms_deg", bound=worst, unit="°"),
        Limit(figure="pitch_rms_deg", bound=worst, unit="°"),
    )


def trot_cases(controller: str = "mpc", seeds: tuple[int, ...] = SEEDS) -> tuple[Case, ...]:
    """Straight trot on flat floor at every stated speed, and how true the estimate is."""
    return tuple(
        Case(
            name=f"trot {1e3 * speed:.0f} mm/s",
            scenario="walk",
            options=_options(controller, gait="trot", speed=speed, duration=30.0),
            seeds=seeds,
            limits=(
                NO_FALL,
                *tilt_limits(roll, pitch, worst),
                Limit(figure="clearance_mm", bound=clearance, side="min", unit="mm"),
                *TROT_SPEEDS.get(speed, (Limit(figure="speed_error_percent", bound=5.0, unit="%"),)),
                *ESTIMATE,
            ),
        )
        for speed, (roll, pitch, worst, clearance) in TROT_BARS.items()
    )


def slow_walk_cases(controller: str = "mpc", seeds: tuple[int, ...] = SEEDS) -> tuple[Case, ...]:
    """The walk with three feet down: at 30 mm/s with bars, at 60 mm/s what the reach of the legs allows."""
    bars: dict[float, tuple[Limit, ...]] = {
        0.03: (
            NO_FALL,
            Limit(figure="zmp_inside_percent", bound=95.0, side="min", unit="%"),
            Limit(figure="plan_margin_mm", bound=5.0, side="min", unit="mm"),
            Limit(figure="roll_rms_deg", bound=0.6, unit="°", over="median"),
            Limit(figure="pitch_rms_deg", bound=0.5, unit="°", over="median"),
            *ESTIMATE,
        ),
        0.06: (NO_FALL,),
    }
    return tuple(
        Case(
            name=f"walk {1e3 * speed:.0f} mm/s",
            scenario="walk",
            options=_options(controller, gait="walk", speed=speed, duration=30.0),
            seeds=seeds,
            limits=limits,
        )
        for speed, limits in bars.items()
    )


def disturbed_cases(controller: str = "mpc", seeds: tuple[int, ...] = SEEDS) -> tuple[Case, ...]:
    """What the controller does not know of: a payload, slopes, steps, a slippery floor."""
    # The draw of the seeds replaces the floor's friction: give it both ends.
    slippery = ("sim.randomization.friction=[0.4, 0.4]",)
    worlds: dict[str, dict[str, Any]] = {
        "payload 0.2 kg": {"payload": PAYLOAD},
        "slope +8°": {"slope": 8.0},
        "slope -8°": {"slope": -8.0},
        "steps of 10 mm": {"world": "steps", "duration": 45.0},
        "friction 0.4": {"overrides": slippery},
    }
    return tuple(
        Case(
            name=name,
            scenario="walk",
            options=_options(controller, **{"gait": "trot", "speed": 0.06, "duration": 30.0, **world}),
            seeds=seeds,
            limits=(HARDLY_A_FALL,),
        )
        for name, world in worlds.items()
    )


def push_battery(controller: str = "mpc", seeds: tuple[int, ...] = SEEDS) -> tuple[Case, ...]:
    """Pushes of 0.1 s from all sides; each run's falls on another part of the cycle."""
    runs = tuple(DIRECTIONS * seed + k for seed in seeds for k in range(DIRECTIONS))
    bars = ((2.0, 0.06, NO_FALL), (3.0, 0.06, HARDLY_A_FALL), (1.5, 0.30, HARDLY_A_FALL))
    return tuple(
        Case(
            name=f"push of {impulse:g} N·s, trot {1e3 * speed:.0f} mm/s",
            scenario="push",
            options=_options(controller, gait="trot", speed=speed, impulse=impulse, duration=10.0),
            seeds=runs,
            directions=DIRECTIONS,
            limits=(limit,),
        )
        for impulse, speed, limit in bars
    )


def manoeuvre_cases(controller: str = "mpc", seeds: tuple[int, ...] = SEEDS) -> tuple[Case, ...]:
    """Turning in place, walking sideways, and changes between trot and walk."""
    turning = Limit(figure="yaw_rate_error_percent", bound=10.0, unit="%")
    return (
        Case(
            name="turn 0.6 rad/s",
            scenario="turn",
            options=_options(controller, speed=0.0, yaw_rate=0.6, duration=20.0),
            seeds=seeds,
            limits=(NO_FALL, turning),
        ),
        Case(
            name="sideways 100 mm/s",
            scenario="walk",
            options=_options(controller, speed=0.0, lateral_speed=0.10, duration=20.0),
            seeds=seeds,
            limits=(NO_FALL, TRACKED),
        ),
        Case(
            name="trot - walk - trot at 40 mm/s",
            scenario="transition",
            options=_options(controller, speed=0.04, duration=24.0),
            seeds=seeds,
            limits=(NO_FALL,),
        ),
    )


def _options(controller: str, **options: Any) -> dict[str, Any]:
    return {"controller": controller, "randomize": "standard", **options}
