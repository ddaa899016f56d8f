"""Whether a configuration may be deployed, by the records of its validation; and if not, what has changed."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bluefoot_mpc.evaluation.validation_plan import LEAST_SEEDS
from bluefoot_mpc.evaluation.validation_record import (
    Record,
    RecordError,
    find_records,
    load_record,
    of_subject,
)
from bluefoot_mpc.evaluation.validation_subject import Code, Subject
from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.io.findings import Finding, Severity
from bluefoot_mpc.scenarios.base import Scenario
from bluefoot_mpc.types import Mode

PART = "validation"
_SAMPLING = 0.05
"""s between two looks at what a scenario commands."""
_MOST_NAMED = 8
"""Changed keys that are named; the others are counted."""
_LIKELY = 40
"""Changed keys up to which an older record counts as one of nearly the same configuration."""
_TOLERANCE = 1e-6


@dataclass(frozen=True, kw_only=True, slots=True)
class Demand:
    """What a scenario will ask of the robot.

    Attributes:
        speed: m/s, greatest speed over ground; 0 where it does not walk.
        gaits: in which it walks.
        turns: it asks for a yaw rate.
        poses: it moves the trunk out of its usual pose.
    """

    speed: float = 0.0
    gaits: frozenset[str] = frozenset()
    turns: bool = False
    poses: bool = False


@dataclass(frozen=True, kw_only=True, slots=True)
class Verdict:
    """What the records say.

    Attributes:
        record: the one that fits; None without.
        findings: refusals where it may not be deployed.
    """

    record: Record | None
    findings: tuple[Finding, ...]

    @property
    def allows(self) -> bool:
        """True where nothing refuses."""
        return self.record is not None and not any(f.severity is Severity.REFUSAL for f in self.findings)


def demand_of(scenario: Scenario) -> Demand:
    """What a scenario commands, sampled from its start to its end.

    Raises:
        ConfigurationError: the scenario fails: it may be a user's code.
    """
    speed, gaits, turns, poses = 0.0, set(), False, False
    for time in np.arange(0.0, scenario.config.duration, _SAMPLING).tolist():
        try:
            motion = scenario.command(time)
            poses |= bool(np.any(motion.trunk.position) or np.any(motion.trunk.rpy))
            if motion.mode is Mode.WALK:
                speed = max(speed, math.hypot(*motion.velocity))
                gaits.add(motion.gait)
                turns |= motion.yaw_rate != 0.0
        except Exception as error:  # Whatever is wrong in it, it may be the user's own code.
            raise ConfigurationError(
                f"scenario '{scenario.name}' fails at {time:.2f} s: {type(error).__name__}: {error}"
            ) from error
    return Demand(speed=speed, gaits=frozenset(gaits), turns=turns, poses=poses)


def judge(folder: Path, subject: Subject, code: Code, demand: Demand, mend: str) -> Verdict:
    """Look for a record that allows a deployment.

    Args:
        folder: where records lie.
        subject: the configuration that is to be deployed.
        code: the code that would run.
        demand: what would be run.
        mend: the command that makes a record.
    """
    files = list(find_records(folder))
    damaged: list[Finding] = []
    records: list[Record] = []
    for file in of_subject(files, subject.sha256):
        try:
            records.append(load_record(file))
        except RecordError as error:
            damaged.append(_finding(str(error), f"Validate again: {mend}"))
    records = [record for record in records if record.table["subject_sha256"] == subject.sha256]
    complaints: list[tuple[Finding, ...]] = []
    for record in sorted(records, key=lambda record: record.made, reverse=True):
        found = (*_objections(record, code, demand, mend), *_beyond(demand))
        verdict = Verdict(record=record, findings=found)
        if verdict.allows:
            return verdict
        complaints.append(found)
    if complaints:
        # The one with the least against it is the one that the user means.
        return Verdict(record=None, findings=min(complaints, key=len))
    if damaged:
        return Verdict(record=None, findings=tuple(damaged))
    return Verdict(record=None, findings=(_unvalidated(files, folder, subject, mend),))


def differences(old: Mapping[str, Any], new: Mapping[str, Any], path: str = "") -> Iterator[str]:
    """Keys whose values differ between two nested tables, with both values."""
    for key in sorted({*old, *new}):
        here = f"{path}.{key}" if path else key
        before, now = old.get(key), new.get(key)
        if isinstance(before, Mapping) and isinstance(now, Mapping):
            yield from differences(before, now, here)
        elif before != now:
            yield f"{here}: {_short(before)} -> {_short(now)}"


def _objections(record: Record, code: Code, demand: Demand, mend: str) -> Iterator[Finding]:
    """What speaks against a deployment by a record of this very configuration."""
    table, plan = record.table, record.plan
    if not record.passed:
        broken = record.broken
        more = f" and {len(broken) - 3} more" if len(broken) > 3 else ""
        text = f"failed on {record.made}: {'; '.join(broken[:3])}{more}"
        yield _finding(text, f"Change the configuration until it passes: {mend}")
    if table["code"] != code.as_plain():
        changed = _some(list(_code_changes(table["code"], code.as_plain())))
        yield _finding(f"the code is not the one of {record.made}: {changed}", f"Validate again: {mend}")
    if not plan.is_full:
        what = "it was a quick one" if plan.quick else f"{plan.seeds} seed(s), {LEAST_SEEDS} are needed"
        yield _finding(f"too little was tried on {record.made}: {what}", f"Validate without --quick: {mend}")
    if demand.speed > plan.speed + _TOLERANCE:
        text = (
            f"validated up to {1e3 * plan.speed:.0f} mm/s, the scenario walks {1e3 * demand.speed:.0f} mm/s"
        )
        yield _finding(text, f"Walk slower, or validate that: {mend} --scenario-speed {demand.speed:g}")
    unknown = demand.gaits - {plan.gait}
    if unknown:
        gait = sorted(unknown)[0]
        text = f"validated with the gait {plan.gait}, the scenario walks with {', '.join(sorted(unknown))}"
        yield _finding(text, f"Validate that: {mend} --gait {gait} --scenario-speed {demand.speed:g}")


def _beyond(demand: Demand) -> Iterator[Finding]:
    """What the battery does not try, and what therefore nobody has promised."""
    for asked, what in ((demand.turns, "turning"), (demand.poses, "posing the trunk")):
        if asked:
            yield Finding(
                part=PART, text=f"{what} is no part of the battery", severity=Severity.WARNING,
                mend="Try it in simulation first: bluefoot run ... --robot emulator",
            )  # fmt: skip


def _unvalidated(files: list[Path], folder: Path, subject: Subject, mend: str) -> Finding:
    """No record of this configuration: what changed since one of nearly the same."""
    identity = subject.identity()
    nearest: tuple[list[str], Record] | None = None
    for file in files:
        try:
            record = load_record(file)
        except RecordError:
            continue
        changes = list(differences(record.table["subject"], identity))
        if len(changes) <= _LIKELY and (nearest is None or len(changes) < len(nearest[0])):
            nearest = changes, record
    text = f"this configuration ({subject.sha256[:16]}) was never validated: no record in {folder}"
    if nearest is not None:
        changes, record = nearest
        text = f"changed since the record of {record.made}: {_some(changes)}"
    return _finding(text, f"Validate it: {mend}")


def _code_changes(old: Mapping[str, Any], new: Mapping[str, Any]) -> Iterator[str]:
    """Files and versions that are not the same."""
    before, now = old.get("files", {}), new["files"]
    yield from (name for name in sorted({*before, *now}) if before.get(name) != now.get(name))
    for key in ("package", "versions"):
        yield from differences({key: old.get(key)}, {key: new[key]})


def _some(changes: list[str]) -> str:
    """The first of many changes, and how many there are besides."""
    more = f" and {len(changes) - _MOST_NAMED} more" if len(changes) > _MOST_NAMED else ""
    return "; ".join(changes[:_MOST_NAMED]) + more


def _finding(text: str, mend: str) -> Finding:
    return Finding(part=PART, text=text, mend=mend, severity=Severity.REFUSAL)


def _short(value: Any) -> str:
    if value is None:
        return "(none)"
    text = str(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
