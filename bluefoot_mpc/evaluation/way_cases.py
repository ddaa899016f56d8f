"""Batteries of runs that find their own way: wandering, approaching a marker, following a leader."""

from __future__ import annotations

from bluefoot_mpc.evaluation.cases import Case
from bluefoot_mpc.evaluation.limits import Limit
from bluefoot_mpc.evaluation.model_cases import NO_FALL
from bluefoot_mpc.wheels.ready import READY

WORLDS = ("room", "corridors", "chairs", "maze", "dead_ends")
SEEDS = tuple(range(10))
LEADER_SEEDS = tuple(range(3))
LEADER_SPEED = 0.12
"""m/s."""
UNTOUCHED = (
    NO_FALL,
    Limit(figure="collisions", bound=0),
    Limit(figure="closest_approach_mm", bound=100.0, side="min", unit="mm"),
)
FREE = Limit(figure="stuck_s", bound=10.0, unit="s")
SEEN = Limit(figure="seen_percent", bound=60.0, side="min", unit="%")
IN_VIEW = Limit(figure="in_view_percent", bound=90.0, side="min", unit="%")
FOLLOWED = (
    Limit(figure="distance_median_mm", bound=450.0, side="min", unit="mm"),
    Limit(figure="distance_median_mm", bound=750.0, unit="mm"),
)
AT_DISTANCE = Limit(figure="distance_error_mm", bound=50.0, unit="mm", over="share", share=0.9)


def wander_cases(controller: str = "mpc", seeds: tuple[int, ...] = SEEDS) -> tuple[Case, ...]:
    """Two minutes in every world, each seed another layout, and ten minutes of one."""
    short = tuple(
        Case(
            name=f"{world}, 120 s",
            scenario="wander",
            options={"controller": controller, "world": world, "duration": 120.0},
            seeds=seeds,
            limits=(*UNTOUCHED, FREE, SEEN),
        )
        for world in WORLDS
    )
    long = tuple(
        Case(
            name=f"{world}, 600 s",
            scenario="wander",
            options={"controller": controller, "world": world, "duration": 600.0},
            seeds=seeds[:1],
            limits=(*UNTOUCHED, FREE, SEEN),
        )
        for world in WORLDS
    )
    return (*short, *long)


def approach_cases(controller: str = "mpc", seeds: tuple[int, ...] = SEEDS) -> tuple[Case, ...]:
    """A marker behind obstacles, each seed another room."""
    return (
        Case(
            name="marker behind obstacles",
            scenario="approach",
            options={"controller": controller, "duration": 120.0},
            seeds=seeds,
            limits=(*UNTOUCHED, FREE, AT_DISTANCE),
        ),
    )


def follow_cases(controller: str = "mpc", seeds: tuple[int, ...] = LEADER_SEEDS) -> tuple[Case, ...]:
    """Every kind of leader on a figure of eight, as fast as a leader may be."""
    return tuple(
        Case(
            name=kind,
            scenario="follow",
            options={
                "controller": controller,
                "leader": kind,
                "duration": 120.0,
                "overrides": (f"scenario.leader_speed={LEADER_SPEED}",),
            },
            seeds=seeds,
            limits=(*UNTOUCHED, IN_VIEW, *FOLLOWED),
        )
        for kind in READY
    )
