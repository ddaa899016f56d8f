"""Rows of the levelling ablation: the compensator with its parts chosen one by one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from bluefoot_mpc.evaluation.cases import Case
from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError

FEEDBACK, PERSISTENCE, NETWORK = "pd", "persistence", "narx"
"""The row that the others are compared with, the cheapest prediction, and the one that has to beat both."""


@dataclass(frozen=True, kw_only=True, slots=True)
class LevelPart:
    """A choice of the compensator's parts.

    Attributes:
        name: as tables and options call it.
        attitude: whether tilt and its rate are fed back.
        psi: where the disturbance comes from.
        learn: when a network learns, as the paper's experiment has it unless given.
        controllers: those under which it is measured.
        meaning: one line for people.
    """

    name: str
    attitude: bool
    psi: str
    learn: str = "off"
    controllers: tuple[str, ...] = ("cpg", "mpc")
    meaning: str

    def overrides(self, controller: str) -> tuple[str, ...]:
        """``section.key=value`` that chooses the parts, with this row's own gains.

        Args:
            controller: under which it runs.
        """
        chosen = (
            f"control.leveling.attitude={str(self.attitude).lower()}", f"control.leveling.psi={self.psi}",
            f"control.leveling.schedule.learn={self.learn}",
        )  # fmt: skip
        return (*chosen, *TUNED.get(controller, {}).get(self.name, ()))


TUNED: Mapping[str, Mapping[str, tuple[str, ...]]] = {"cpg": {}, "mpc": {}}
"""By controller and row: gains that were tuned for this row; a row without has those of the configuration."""

LEVEL_PARTS = (
    LevelPart(
        name="mix", attitude=False, psi="zero", controllers=("cpg",),
        meaning="mixing alone: no levelling torque, softer servos",
    ),
    LevelPart(name=FEEDBACK, attitude=True, psi="zero", meaning="attitude feedback"),
    LevelPart(name=NETWORK, attitude=True, psi="network", meaning="attitude feedback and the network"),
    LevelPart(
        name="always", attitude=True, psi="network", learn="always",
        meaning="the same, with a network that goes on learning while it acts",
    ),
    LevelPart(
        name="network", attitude=False, psi="network", controllers=("cpg",),
        meaning="the network without attitude feedback",
    ),
    LevelPart(
        name=PERSISTENCE, attitude=True, psi="persistence",
        meaning="attitude feedback and the disturbance last measured",
    ),
    LevelPart(
        name="model", attitude=True, psi="model",
        meaning="attitude feedback and the disturbance by the robot's model",
    ),
)  # fmt: skip
"""In the order of the tables."""


def with_part(case: Case, part: LevelPart) -> Case:
    """The case, levelled by this part; what the case itself overrides stays."""
    own = part.overrides(case.options["controller"])
    return replace(case, options={**case.options, "overrides": (*case.options.get("overrides", ()), *own)})


def parts_of(name: str, case: Case, parts: Sequence[LevelPart]) -> tuple[LevelPart, ...]:
    """Those of the parts that are meant for the case's controller.

    Args:
        name: of the case, for people.
        case: what is run.
        parts: what may level.

    Raises:
        ConfigurationError: there is none.
    """
    found = _meant_for(case, parts)
    if not found:
        chosen = ", ".join(part.name for part in parts)
        valid = ", ".join(part.name for part in _meant_for(case, LEVEL_PARTS))
        raise ConfigurationError(
            f"case '{name}' has nothing to run: {chosen} is not measured under "
            f"{case.options['controller']}. Take some of: {valid}, or leave the case out"
        )
    return found


def _meant_for(case: Case, parts: Sequence[LevelPart]) -> tuple[LevelPart, ...]:
    return tuple(part for part in parts if case.options["controller"] in part.controllers)


def level_parts(names: tuple[str, ...] = ()) -> tuple[LevelPart, ...]:
    """The rows of these names, all of them where none is given.

    Raises:
        UnknownNameError: there is no such row.
    """
    known = {part.name: part for part in LEVEL_PARTS}
    for name in names:
        if name not in known:
            raise UnknownNameError("levelling part", name, known)
    return tuple(part for name, part in known.items() if name in names or not names)
