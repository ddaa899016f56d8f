"""The largest push that a walking robot survives, direction by direction."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from bluefoot_mpc.evaluation.battery import Store, run_battery
from bluefoot_mpc.evaluation.cases import Case
from bluefoot_mpc.exceptions import ConfigurationError


@dataclass(frozen=True, kw_only=True, slots=True)
class PushSearch:
    """How the limit is looked for."""

    directions: int = 12  # evenly spaced, the first forward
    seeds: int = 3  # robots, each pushed in another part of its cycle
    speed: float = 0.06  # m/s, trot
    least: float = 0.5  # N·s, taken as survived
    most: float = 8.5  # N·s, taken as not survived
    halvings: int = 5  # of that range

    def __post_init__(self) -> None:
        if not 0.0 < self.least < self.most:
            raise ConfigurationError(
                f"least = {self.least:g} N·s must lie between 0 and most = {self.most:g}"
            )
        for name in ("directions", "seeds", "halvings"):
            if getattr(self, name) < 1:
                raise ConfigurationError(f"{name} = {getattr(self, name)!r} must be at least 1")

    @property
    def runs(self) -> int:
        """Simulations of one controller."""
        return self.directions * self.seeds * self.halvings

    @property
    def resolution(self) -> float:
        """N·s between the largest impulse that was survived and the least that was not."""
        return (self.most - self.least) / float(2**self.halvings)


@dataclass(frozen=True, kw_only=True, slots=True)
class PushLimit:
    """The limit in one direction.

    Attributes:
        direction: degrees that the push points to, from forward, left positive.
        survived: by seed, the largest impulse that was survived, N·s.
    """

    direction: float
    survived: tuple[float, ...]

    @property
    def median(self) -> float:
        """N·s, over the seeds."""
        return statistics.median(self.survived)

    @property
    def least(self) -> float:
        """N·s, of the weakest seed."""
        return min(self.survived)


def push_limits(
    controller: str,
    search: PushSearch,
    store: Store,
    *,
    workers: int | None = None,
    progress: Callable[[Case, int], None] | None = None,
) -> list[PushLimit]:
    """Halve the range of impulses for every direction and seed at once, round by round.

    A robot that survives a push is taken to survive every smaller one in the
    same direction at the same moment.

    Args:
        controller: what walks.
        search: directions, seeds and range.
        store: earlier results; new ones are added as they come.
        workers: processes; None takes one per core.
        progress: called after every run.
    """
    angles = [360.0 * k / search.directions for k in range(search.directions)]
    low = {(angle, seed): search.least for angle in angles for seed in range(search.seeds)}
    high = dict.fromkeys(low, search.most)
    for _ in range(search.halvings):
        middle = {key: 0.5 * (low[key] + high[key]) for key in low}
        cases = [_case(controller, search.speed, impulse, *key) for key, impulse in middle.items()]
        verdicts = run_battery(cases, store, workers=workers, progress=progress)
        for (key, impulse), verdict in zip(middle.items(), verdicts, strict=True):
            fell = any(value != 0.0 for value in verdict.values("falls"))
            (high if fell else low)[key] = impulse
    return [
        PushLimit(direction=angle, survived=tuple(low[angle, seed] for seed in range(search.seeds)))
        for angle in angles
    ]


def as_plain(limits: Sequence[PushLimit]) -> list[dict[str, object]]:
    """Limits for programs."""
    return [
        {
            "direction_deg": limit.direction, "median_ns": limit.median, "least_ns": limit.least,
            "survived_ns": list(limit.survived),
        }
        for limit in limits
    ]  # fmt: skip


def _case(controller: str, speed: float, impulse: float, direction: float, seed: int) -> Case:
    return Case(
        name=f"push of {impulse:g} N·s to {direction:.0f}°",
        scenario="push",
        options={
            "controller": controller, "randomize": "standard", "gait": "trot", "speed": speed,
            "impulse": impulse, "direction": direction, "duration": 9.0,
        },
        seeds=(seed,),
    )  # fmt: skip
