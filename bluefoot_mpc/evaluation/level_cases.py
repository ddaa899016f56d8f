"""Cases of the levelling ablation: the paper's runs, disturbances, and model-based control."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from bluefoot_mpc.evaluation.cases import Case
from bluefoot_mpc.evaluation.level_parts import NETWORK, level_parts, with_part
from bluefoot_mpc.evaluation.limits import Limit
from bluefoot_mpc.evaluation.model_cases import NO_FALL, PAYLOAD
from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError
from bluefoot_mpc.scenarios.leveling import (
    LEAST_DURATION,
    LEAST_REDUCTION,
    MOST_HARM,
    MOST_SINKING,
    SPEED_NOISE,
)

DEFAULT_CASES = ("level-60", "level-80", "level-100", "level-payload", "level-mpc-60-payload")
"""What runs where nobody chooses."""
PAPER = ((0.06, 0.25), (0.06, 0.125), (0.06, 0.35), (0.08, 0.35), (0.10, 0.35))
"""Speeds (m/s) and shares of the levelling goals in the goals (paper, table of the experiment)."""

COMMON = (
    NO_FALL,
    Limit(figure="disengaged", bound=0),
    Limit(figure="speed_change_percent", bound=-SPEED_NOISE, side="min", unit="%", over="median"),
    Limit(figure="height_change_mm", bound=-1e3 * MOST_SINKING, side="min", unit="mm", over="median"),
)
"""What levelling must keep everywhere."""
WRONG_SERVOS = (
    "sim.randomization.servo_gain=0.5", "sim.randomization.mass=0.0", "sim.randomization.com=0.0",
    "sim.randomization.friction=[0.8, 0.8]", "sim.randomization.voltage=[12.0, 12.0]",
    "sim.randomization.latency=[0.02, 0.02]",
)  # fmt: skip
"""A robot that is nominal but for its servos: each one's gain anywhere within ± 50 %."""
DISTURBANCES: dict[str, tuple[str, dict[str, Any]]] = {
    "payload": ("payload 0.2 kg off centre", {"payload": PAYLOAD}),
    "slope-up": ("slope +5°", {"slope": 5.0}),
    "slope-down": ("slope -5°", {"slope": -5.0}),
    "servos": ("servo gains ± 50 %", {"randomize": "standard", "overrides": WRONG_SERVOS}),
    "rough": ("rough ground of 6 mm", {"world": "rough", "overrides": ("sim.world.rough_height=0.006",)}),
    "friction": ("friction 0.4", {"friction": 0.4}),
}
"""By name: title and options of what no part of the compensator knows of; nominal robots."""


def level_cases() -> dict[str, Case]:
    """Every case, by the name that options take."""
    return {**_paper_cases("none"), **_paper_cases("standard"), **_disturbed_cases(), **_residual_cases()}


def level_battery() -> tuple[Case, ...]:
    """Every case, levelled as it is delivered: attitude feedback and the network."""
    (part,) = level_parts((NETWORK,))
    return tuple(with_part(case, part) for case in level_cases().values())


def chosen_level_cases(names: Sequence[str], seeds: int, duration: float | None) -> dict[str, Case]:
    """Cases by name, with as many seeds and of that length.

    Args:
        names: of `level_cases`.
        seeds: how many, from 0.
        duration: s of every run; None keeps the scenario's own.

    Raises:
        ConfigurationError: no window with levelling fits into the duration.
        UnknownNameError: there is no such case.
    """
    known = level_cases()
    for name in names:
        if name not in known:
            raise UnknownNameError("case", name, known)
    if duration is not None and duration < LEAST_DURATION:
        raise ConfigurationError(
            f"--duration = {duration:g} s is too short for a window without and one with levelling: "
            f"take {LEAST_DURATION:g} or more, or leave it out"
        )
    length = {} if duration is None else {"duration": duration}
    return {
        name: replace(case, seeds=tuple(range(seeds)), options={**case.options, **length})
        for name, case in known.items()
        if name in names
    }


def _paper_cases(randomize: str) -> dict[str, Case]:
    """The paper's runs with the nominal robot, or with randomised ones."""
    found = {}
    for speed, mix in PAPER:
        name, title = f"level-{1e3 * speed:.0f}", f"trot {1e3 * speed:.0f} mm/s, α {mix:g}"
        if (speed, mix) in PAPER[1:3]:
            name += f"-mix-{mix:g}"
        if randomize != "none":
            name, title = f"{name}-random", f"{title}, randomised robots"
        least = LEAST_REDUCTION if speed <= PAPER[0][0] and mix == PAPER[0][1] else 0.0
        options = {"speed": speed, "level_mix": mix, "randomize": randomize}
        found[name] = _case(title, "cpg", _reduced("roll", least) + _reduced("pitch", least), options)
    return found


def _disturbed_cases() -> dict[str, Case]:
    """60 mm/s, with what nobody told the compensator."""
    speed, mix = PAPER[0]
    return {
        f"level-{name}": _case(
            f"trot {1e3 * speed:.0f} mm/s, {title}", "cpg", _reduced("tilt", 0.0),
            {"speed": speed, "level_mix": mix, **options},
        )
        for name, (title, options) in DISTURBANCES.items()
    }  # fmt: skip


def _residual_cases() -> dict[str, Case]:
    """Levelling on top of model-based control, randomised robots, with and without a payload."""
    found = {}
    for loaded in (False, True):
        for speed in (0.06, 0.10):
            name, title = f"level-mpc-{1e3 * speed:.0f}", f"mpc, trot {1e3 * speed:.0f} mm/s"
            options: dict[str, Any] = {"speed": speed, "randomize": "standard"}
            if loaded:
                name, title, options = f"{name}-payload", f"{title}, payload", {**options, "payload": PAYLOAD}
            found[name] = _case(title, "mpc", _reduced("tilt", -MOST_HARM), options)
    return found


def _reduced(axis: str, least: float) -> tuple[Limit, ...]:
    figure = f"{axis}_reduction_percent"
    return (Limit(figure=figure, bound=least, side="min", unit="%", over="median"),)


def _case(title: str, controller: str, limits: tuple[Limit, ...], options: dict[str, Any]) -> Case:
    return Case(
        name=title, scenario="level", options={"controller": controller, **options},
        limits=(*COMMON, *limits),
    )  # fmt: skip
