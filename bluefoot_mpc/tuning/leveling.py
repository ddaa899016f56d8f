"""What trunk levelling is tuned for: its gains, its parts, and a cost against the same run without it.

The cost of a case is a ratio, so 1 means "as without levelling"::

    cost = tilt / tilt_off + penalties
    tilt = hypot(median roll RMS, median pitch RMS)
    penalties = FALL      x share of seeds that fell
              + STOP      x share of the time that levelling had disengaged itself
              + SINK      x (millimetres that the trunk stands lower than without, beyond MOST_SINKING)
              + CLEARANCE x (millimetres of swing clearance lost beyond MOST_CLEARANCE_LOST)
              + SPEED     x (percent of speed lost beyond MOST_SPEED_LOST)
              + RING      x (shares by which joint speed and torque RMS rise beyond MOST_RINGING)

Without the penalties a search goes for gains at which trunk and servos ring,
the trunk sinks and the feet shuffle. Of several cases the worst counts.
"""

from __future__ import annotations

import json
import math
import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError
from bluefoot_mpc.scenarios.leveling import UNCOMPENSATED
from bluefoot_mpc.settings import require_positive
from bluefoot_mpc.tuning.cases import STAND, TuningCase, trot_bars
from bluefoot_mpc.tuning.objective import FALL, Figures
from bluefoot_mpc.tuning.space import Parameter, Space

STOP, SINK, CLEARANCE, SPEED, RING = 2.0, 0.1, 0.03, 0.05, 1.0
"""Weights of the penalties, see above."""
MOST_SINKING = 4.0
"""mm; the aim is 5 at most."""
MOST_CLEARANCE_LOST = 3.0
"""mm."""
MOST_SPEED_LOST = 3.0
"""Percent, about what windows of a few seconds differ by chance."""
MOST_RINGING = 0.2
"""Share by which joint speeds or torques may rise."""
LEARNING = 10.0
"""s of walking without levelling, in which the network learns; other parts wait as long."""
SETTLING = 1.5
"""s of levelling before figures count."""
MEASURED = 8.0
"""s that figures count: whole cycles of the trot with a cycle of a second."""

PARTS: dict[str, tuple[str, ...]] = {
    "mixing": ('control.leveling.psi="zero"', "control.leveling.attitude=false"),
    "pd": ('control.leveling.psi="zero"',),
    "network": ('control.leveling.psi="network"',),
    "persistence": ('control.leveling.psi="persistence"',),
    "model": ('control.leveling.psi="model"',),
}
"""Settings by part; those with ψ keep the attitude part."""


def _overrides(section: str, table: Mapping[str, Any]) -> tuple[str, ...]:
    """A nested table as ``section.key=value``."""
    found: list[str] = []
    for key, value in table.items():
        path = f"{section}.{key}"
        # JSON writes numbers and booleans as TOML does.
        found += _overrides(path, value) if isinstance(value, Mapping) else (f"{path}={json.dumps(value)}",)
    return tuple(found)


UNLEVELLED_TROT = _overrides("control", UNCOMPENSATED)
"""The walk of scenario ``level`` under the paper's laws: gains are searched on what they are judged by."""
OFF = ("control.leveling.enabled=false",)


@dataclass(frozen=True, kw_only=True, slots=True)
class LevelCase:
    """One condition that levelling is tuned for."""

    speed: float = 0.06  # m/s
    mix: float = 0.25  # α
    controller: str = "cpg"
    payload: tuple[float, float, float, float] | None = None  # kg and m in the base frame, unmodelled
    randomize: str = "standard"

    def __post_init__(self) -> None:
        require_positive(speed=self.speed, mix=self.mix)

    @property
    def name(self) -> str:
        """What it is called."""
        load = " payload" if self.payload else ""
        return f"{self.controller} {1e3 * self.speed:.0f} mm/s mix {self.mix:g}{load}"

    def tuning_case(self) -> TuningCase:
        """The same for a study."""
        acts = STAND + LEARNING
        start = acts + SETTLING
        gait = UNLEVELLED_TROT if self.controller == "cpg" else ()
        schedule = (
            f"control.leveling.schedule.start={acts}",
            # Learning begins when the gait has begun: a little later than the command.
            f"control.leveling.schedule.learn_time={LEARNING - 1.0}",
        )
        return TuningCase(
            name=self.name,
            scenario="walk",
            options={
                "speed": self.speed, "payload": self.payload, "randomize": self.randomize,
                "duration": start + MEASURED,
                "overrides": (
                    f"scenario.stand_time={STAND}", *gait, *schedule,
                    "control.leveling.enabled=true", f"control.leveling.mix={self.mix}",
                ),
            },
            bars=trot_bars(self.speed),
            start=start,
        )  # fmt: skip


def level_space(part: str) -> Space:
    """The gains K_b and K_d of roll and pitch, for one part.

    Args:
        part: one of `PARTS`.

    Raises:
        UnknownNameError: there is no such part.
    """
    if part not in PARTS:
        raise UnknownNameError("part", part, PARTS)
    gains = "control.leveling.gains"
    return Space(
        parameters=(
            Parameter(name="tilt", keys=(f"{gains}.tilt",), low=500.0, high=30000.0, log=True),
            Parameter(name="tilt_rate", keys=(f"{gains}.tilt_rate",), low=0.0, high=400.0),
        ),
        fixed=PARTS[part],
    )


def level_penalties(figures: Sequence[Figures], without: Sequence[Figures]) -> dict[str, float]:
    """What each broken condition adds, by name.

    Args:
        figures: one entry for each seed.
        without: the same seeds without levelling.
    """

    def middle(name: str, runs: Sequence[Figures]) -> float:
        return float(statistics.median(getattr(run, name) for run in runs))

    def lost(name: str) -> float:
        return middle(name, without) - middle(name, figures)

    def risen(name: str) -> float:
        before = middle(name, without)
        return middle(name, figures) / before - 1.0 if before > 0.0 else 0.0

    slower = 100.0 * lost("speed_error") / (100.0 + middle("speed_error", without))
    rise = max(risen("joint_speed"), risen("torque"))
    return {
        "fall": FALL * statistics.fmean(run.fell for run in figures),
        "stop": STOP * statistics.fmean(run.stopped for run in figures),
        "sink": SINK * max(0.0, lost("height") - MOST_SINKING),
        "clearance": CLEARANCE * max(0.0, lost("clearance") - MOST_CLEARANCE_LOST),
        "speed": SPEED * max(0.0, slower - MOST_SPEED_LOST),
        "ring": RING * max(0.0, rise - MOST_RINGING),
    }


def tilt(figures: Sequence[Figures]) -> float:
    """Degrees: both medians of roll and pitch RMS as one."""
    return math.hypot(statistics.median(f.roll for f in figures), statistics.median(f.pitch for f in figures))


def level_cost(figures: Sequence[Figures], without: Sequence[Figures]) -> float:
    """Cost of a set of seeds against the same seeds without levelling; 1 is "no better".

    Args:
        figures: one entry for each seed.
        without: runs without levelling, the same seeds first and in the same order.

    Raises:
        ConfigurationError: there is no seed, or one has no run without levelling.
    """
    if not figures or len(without) < len(figures):
        raise ConfigurationError(
            f"{len(figures)} runs cannot be compared with {len(without)} without levelling: "
            "run the same seeds without"
        )
    same = without[: len(figures)]
    return tilt(figures) / tilt(same) + sum(level_penalties(figures, same).values())


@dataclass(frozen=True, kw_only=True, slots=True)
class LevelJudge:
    """The cost of the worst of several cases, for `run_study`.

    Attributes:
        without: by case name, runs without levelling in the order of the study's seeds.
    """

    without: Mapping[str, Sequence[Figures]]

    def __call__(self, cases: Sequence[TuningCase], seen: Mapping[str, Sequence[Figures]]) -> float:
        """The largest of the cases' costs."""
        return max(level_cost(seen[case.name], self.without[case.name]) for case in cases)
