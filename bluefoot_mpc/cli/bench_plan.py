"""What a command line of ``bluefoot bench`` asks for."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from bluefoot_mpc.cli.arguments import BenchCommand
from bluefoot_mpc.evaluation import ablation
from bluefoot_mpc.evaluation.cases import Case
from bluefoot_mpc.evaluation.level_cases import DEFAULT_CASES, chosen_level_cases, level_cases
from bluefoot_mpc.evaluation.level_parts import LEVEL_PARTS, LevelPart, level_parts, parts_of
from bluefoot_mpc.evaluation.push_limit import PushSearch
from bluefoot_mpc.evaluation.variants import VARIANTS, Variant, variants
from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError

PARTS = ("ablation", "timing", "pushes", "level")
ABLATION_CASES = ("walk-30", "trot-100", "payload", "slope-up")
"""Cases of the ablation where nobody chooses."""
FULL_SEEDS = 20
ALL = "all"
_TIMED_DURATION = 8.0


@dataclass(frozen=True, kw_only=True, slots=True)
class Plan:
    """What a bench measures.

    Attributes:
        parts: of `PARTS`.
        cases: of the ablation, by name.
        rows: variants of the ablation, the timing and the pushes.
        level_cases: of the ablation of trunk levelling, by name.
        level_parts: its rows.
        pushes: how the limit of pushes is looked for.
        duration: s of the timed runs.
    """

    parts: tuple[str, ...]
    cases: dict[str, Case]
    rows: tuple[Variant, ...]
    level_cases: dict[str, Case]
    level_parts: tuple[LevelPart, ...]
    pushes: PushSearch
    duration: float

    @property
    def needs_variants(self) -> bool:
        """True where a part compares whole controllers."""
        return any(part != "level" for part in self.parts)


def plan_of(command: BenchCommand) -> Plan:
    """What a command line asks for.

    Raises:
        ConfigurationError: nothing is asked for, a part without any of its cases, or a case without rows.
        UnknownNameError: a part, case or row does not exist.
    """
    parts = PARTS if command.full else names(command.parts)
    _require_known("part", parts, PARTS)
    if not parts:
        raise ConfigurationError(f"--parts names no part. Valid: {', '.join(PARTS)}")
    seeds = FULL_SEEDS if command.full else command.seeds
    rows = {part: tuple(known) for part, known in _rows(parts).items()}
    wanted = names(command.variants)
    _require_known("variant", wanted, [name for known in rows.values() for name in known])
    cases = _cases(command, parts)
    level_rows = level_parts(tuple(name for name in wanted if name in rows.get("level", ())))
    level = chosen_level_cases(cases.get("level", ()), seeds, command.duration if "level" in parts else None)
    return Plan(
        parts=parts,
        cases=ablation.chosen(cases.get("ablation", ()), seeds, command.duration),
        rows=variants(tuple(name for name in wanted if name in rows.get("ablation", ()))),
        level_cases=_with_rows(level, level_rows, _names_cases(command)),
        level_parts=level_rows,
        pushes=PushSearch(seeds=seeds),
        duration=command.duration or _TIMED_DURATION,
    )


def names(text: str) -> tuple[str, ...]:
    """The names of a list with commas."""
    return tuple(name.strip() for name in text.split(",") if name.strip())


def _rows(parts: tuple[str, ...]) -> dict[str, list[str]]:
    """Names of the rows that the parts know: controllers, and parts of trunk levelling."""
    found = {}
    if set(parts) - {"level"}:
        found["ablation"] = [variant.name for variant in VARIANTS]
    if "level" in parts:
        found["level"] = [part.name for part in LEVEL_PARTS]
    return found


def _cases(command: BenchCommand, parts: tuple[str, ...]) -> dict[str, tuple[str, ...]]:
    """Names of the cases of each part that has any."""
    known = {"ablation": tuple(ablation.bench_cases()), "level": tuple(level_cases())}
    known = {part: cases for part, cases in known.items() if part in parts}
    if not _names_cases(command) and (command.full or command.cases is not None):
        return known
    if command.cases is None:
        own = {"ablation": ABLATION_CASES, "level": DEFAULT_CASES}
        return {part: own[part] for part in known}
    wanted = names(command.cases)
    if known:
        _require_known("case", wanted, [*(name for cases in known.values() for name in cases), ALL])
    found = {part: tuple(name for name in cases if name in wanted) for part, cases in known.items()}
    for part, cases in found.items():
        if not cases:
            raise ConfigurationError(
                f"--cases names no case of {part}. Valid: {', '.join(known[part])}, {ALL}"
            )
    return found


def _names_cases(command: BenchCommand) -> bool:
    """True where somebody chose the cases one by one."""
    return not command.full and command.cases is not None and names(command.cases) != (ALL,)


def _with_rows(cases: dict[str, Case], rows: tuple[LevelPart, ...], named: bool) -> dict[str, Case]:
    """The cases under whose controller a row is measured; one that was named has to be such a case."""
    if named:
        for name, case in cases.items():
            parts_of(name, case, rows)
    return {
        name: case
        for name, case in cases.items()
        if any(case.options["controller"] in row.controllers for row in rows)
    }


def _require_known(kind: str, wanted: Iterable[str], known: Iterable[str]) -> None:
    valid = tuple(known)
    for name in wanted:
        if name not in valid:
            raise UnknownNameError(kind, name, valid)
