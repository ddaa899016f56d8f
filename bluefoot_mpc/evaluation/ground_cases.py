"""Batteries of runs over rough ground, looking where to step and blind."""

from __future__ import annotations

from bluefoot_mpc.evaluation.cases import Case
from bluefoot_mpc.evaluation.limits import Limit

SEEDS = tuple(range(20))
DURATION = 140.0
"""s for 1.5 m with all sweeps."""
LONGER = {"ramp": 220.0}
"""s, where more sweeps are needed: a way down is seen from near only."""
BLIND_DURATION = 62.0
"""s for 1.5 m at 30 mm/s without any."""
BLIND_TROT_DURATION = 35.0
"""s for 1.5 m at 60 mm/s."""
STEP_HEIGHTS = (0.015, 0.025, 0.035, 0.045)
"""m, of a blind walk: the best of them counts."""
TROT_STEP_HEIGHTS = (0.025, 0.040)
"""m, of a blind trot."""
ROUGHEST = 0.030
"""m, height of the rubble over which looking must beat walking blind."""


def crossed(count: int) -> Limit:
    """At least `count` of 20 runs cross without a fall."""
    return Limit(figure="crossed", bound=1.0, side="min", over="share", share=count / 20)


MAPPED = (
    Limit(figure="map_error_median_mm", bound=5.0, unit="mm"),
    Limit(figure="map_error_95_mm", bound=15.0, unit="mm"),
)
GROUNDS: dict[str, tuple[str, tuple[str, ...], tuple[Limit, ...]]] = {
    "rubble 20 mm": ("rubble", ("sim.world.terrain_height=0.02",), (crossed(18),)),
    "rubble 30 mm": ("rubble", (f"sim.world.terrain_height={ROUGHEST}",), (crossed(12),)),
    "kerb 25 mm": ("kerb", ("sim.world.terrain_height=0.025",), (crossed(18),)),
    "stepping stones": ("stones", ("sim.world.stone=0.12", "sim.world.gap=0.06"), (crossed(15),)),
    "random steps": ("random_steps", (), (crossed(15),)),
    "ramp": ("ramp", (), (crossed(15),)),
    "gap": ("gap", (), (crossed(15),)),
}
"""Name: the world, what of it is set, and what must be reached (of the last three nobody asked it)."""


def sweep_cases(controller: str = "mpc", seeds: tuple[int, ...] = SEEDS) -> tuple[Case, ...]:
    """One sweep, mapped in cells of 20 mm: what the map is worth on the cells that were seen."""
    coarse = tuple(f"control.crossing.map.{key}" for key in ("cell=0.02", "gap=1", "gap_trust=0.6"))
    return tuple(
        Case(
            name=f"map of rubble {1e3 * height:.0f} mm",
            scenario="sweep",
            options={
                "controller": controller,
                "world": "rubble",
                "overrides": (*coarse, f"sim.world.terrain_height={height}"),
            },
            seeds=seeds,
            limits=MAPPED,
        )
        for height in (0.020, ROUGHEST)
    )


def crossing_cases(
    controller: str = "mpc", seeds: tuple[int, ...] = SEEDS, *, incremental: bool = False
) -> tuple[Case, ...]:
    """To a goal line 1.5 m ahead over every kind of ground; each seed is another ground.

    Args:
        controller: what walks.
        seeds: of ground and errors.
        incremental: map while walking, rather than stop and sweep.
    """
    mode = ("scenario.incremental=true",) if incremental else ()
    return tuple(
        Case(
            name=name,
            scenario="rough",
            options={
                "controller": controller,
                "world": world,
                "duration": LONGER.get(name, DURATION),
                "overrides": (*overrides, *mode),
            },
            seeds=seeds,
            limits=limits,
        )
        for name, (world, overrides, limits) in GROUNDS.items()
    )


def error_cases(controller: str = "mpc", seeds: tuple[int, ...] = SEEDS[:10]) -> tuple[Case, ...]:
    """A LIDAR that sits 5 mm and 2 degrees elsewhere than the robot believes: its maps must not topple it."""
    upright = (Limit(figure="upright", bound=1.0, side="min", over="share", share=1.0),)
    return tuple(
        Case(
            name=f"{name}, map {2.0 * sign:+.0f} degrees and {5.0 * sign:+.0f} mm",
            scenario="rough",
            options={
                "controller": controller,
                "world": GROUNDS[name][0],
                "duration": DURATION,
                "overrides": (
                    *GROUNDS[name][1],
                    f"sim.lidar.mount_error_deg=[0.0, {2.0 * sign}, 0.0]",
                    f"sim.lidar.mount_error_m=[0.0, 0.0, {0.005 * sign}]",
                ),
            },
            seeds=seeds,
            limits=upright,
        )
        for name in ("rubble 20 mm", "kerb 25 mm")
        for sign in (1.0, -1.0)
    )


def incremental_cases(controller: str = "mpc", seeds: tuple[int, ...] = SEEDS) -> tuple[Case, ...]:
    """The same ground, mapped while walking; nothing is asked of it but to be measured."""
    named = ("rubble 20 mm", "stepping stones")
    cases = crossing_cases(controller, seeds, incremental=True)
    return tuple(
        Case(name=f"{c.name}, incremental", scenario=c.scenario, options=c.options, seeds=c.seeds)
        for c in cases
        if c.name in named
    )


def blind_cases(controller: str = "mpc", seeds: tuple[int, ...] = SEEDS) -> tuple[Case, ...]:
    """The roughest rubble without looking: a walk and a trot, each with several step heights."""
    walks = [("walk", height, 0.03, BLIND_DURATION) for height in STEP_HEIGHTS]
    trots = [("trot", height, 0.06, BLIND_TROT_DURATION) for height in TROT_STEP_HEIGHTS]
    return tuple(
        Case(
            name=f"blind {gait}, steps of {1e3 * height:.0f} mm",
            scenario="rough",
            options={
                "controller": controller, "world": "rubble", "duration": duration, "gait": gait,
                "speed": speed, "blind": True,
                "overrides": (f"sim.world.terrain_height={ROUGHEST}", f"scenario.step_height={height}"),
            },
            seeds=seeds,
        )
        for gait, height, speed, duration in (*walks, *trots)
    )  # fmt: skip
