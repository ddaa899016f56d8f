"""What a validation leaves: a record under the hash of what was validated, and how it is read back.

The record carries a hash of itself. That finds files that were damaged or edited
by hand; it is no signature, and keeps nobody out who wants to forge one.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import orjson

from bluefoot_mpc.evaluation.battery import Verdict
from bluefoot_mpc.evaluation.limits import Limit
from bluefoot_mpc.evaluation.validation_plan import Plan
from bluefoot_mpc.evaluation.validation_subject import Code, Subject, table_hash
from bluefoot_mpc.exceptions import ConfigurationError

FORMAT = 1
RECORDS_VARIABLE = "BLUEFOOT_RECORDS"
_SHORT = 16
"""Digits of a hash in a file's name."""
_KEYS = ("format", "made", "passed", "plan", "subject_sha256", "subject", "code", "cases", "sha256")


class RecordError(ConfigurationError):
    """A record cannot be trusted; the message says why."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Record:
    """A validation as it is kept.

    Attributes:
        file: where it lies.
        table: everything in it, plain values.
    """

    file: Path
    table: Mapping[str, Any]

    @property
    def passed(self) -> bool:
        """Whether every limit of every case holds."""
        return bool(self.table["passed"])

    @property
    def plan(self) -> Plan:
        """How much was validated."""
        return Plan(**self.table["plan"])

    @property
    def made(self) -> str:
        """Date and time, ISO 8601."""
        return str(self.table["made"])

    @property
    def broken(self) -> list[str]:
        """Limits that do not hold, in words."""
        return [
            f"{case['name']}: {_seen(limit)}, wanted {limit['text']}"
            for case in self.table["cases"]
            for limit in case["limits"]
            if not limit["holds"]
        ]


def records_folder(wanted: Path | None = None) -> Path:
    """The folder asked for, or that of ``$BLUEFOOT_RECORDS``, or the user's own."""
    named = os.environ.get(RECORDS_VARIABLE)
    if wanted is not None:
        return wanted
    return Path(named) if named else Path.home() / ".local/share/bluefoot/validation"


def record_table(
    subject: Subject, code: Code, plan: Plan, verdicts: Sequence[Verdict], extra: Mapping[str, Any]
) -> dict[str, Any]:
    """The contents of a record, its own hash included.

    Args:
        subject: what was validated.
        code: with which code.
        plan: how much.
        verdicts: a result for every case.
        extra: what is noted besides: ``made``, ``versions`` and so on.
    """
    cases = [_case(verdict) for verdict in verdicts]
    table = {
        "format": FORMAT,
        **extra,
        "passed": all(case["passed"] for case in cases),
        "plan": _plan_table(plan),
        "subject_sha256": subject.sha256,
        "subject": subject.identity(),
        "code": code.as_plain(),
        "cases": cases,
    }
    return {**table, "sha256": own_hash(table)}


def own_hash(table: Mapping[str, Any]) -> str:
    """Hash of all that a record says, as it reads back from its file."""
    said = {key: value for key, value in table.items() if key != "sha256"}
    return table_hash(orjson.loads(orjson.dumps(said)))


def record_file(folder: Path, table: Mapping[str, Any]) -> Path:
    """Where a record belongs: the hash of the configuration, then that of code and plan."""
    code = {key: table["code"][key] for key in ("package", "source", "versions")}
    run = table_hash({"code": code, "plan": table["plan"]})
    return folder / f"{table['subject_sha256'][:_SHORT]}-{run[:8]}.json"


def save_record(folder: Path, table: Mapping[str, Any]) -> Record:
    """Write a record, whole or not at all.

    Raises:
        ConfigurationError: it cannot be written.
    """
    file = record_file(folder, table)
    part = file.with_suffix(".part")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        part.write_bytes(orjson.dumps(dict(table), option=orjson.OPT_INDENT_2) + b"\n")
        part.replace(file)
    except OSError as error:
        raise ConfigurationError(f"cannot write the record {file}: {error.strerror or error}") from error
    return Record(file=file, table=table)


def load_record(file: Path) -> Record:
    """Read a record and check that it is what was written.

    Raises:
        RecordError: it is unreadable, damaged or edited.
    """
    try:
        table = orjson.loads(file.read_bytes())
    except OSError as error:
        raise RecordError(f"{file} cannot be read: {error.strerror or error}") from error
    except orjson.JSONDecodeError as error:
        raise RecordError(f"{file} is damaged: {error}") from error
    if not isinstance(table, dict) or any(key not in table for key in _KEYS):
        raise RecordError(f"{file} is no record of a validation")
    if table["format"] != FORMAT:
        raise RecordError(f"{file} was written by another version (format {table['format']})")
    if any(not isinstance(table[key], dict) for key in ("subject", "plan", "code")):
        raise RecordError(f"{file} is no record of a validation")
    if table["sha256"] != own_hash(table) or table["subject_sha256"] != table_hash(table["subject"]):
        raise RecordError(f"{file} does not fit its own hash: it was edited or damaged")
    try:
        is_consistent = _plan_table(Plan(**table["plan"])) == table["plan"] and (
            table["passed"] == _passes(table["cases"])
        )
    except (TypeError, KeyError, AttributeError, ConfigurationError) as error:
        raise RecordError(f"{file} is no record of a validation: {error!r}") from error
    if not is_consistent:
        raise RecordError(f"{file} contradicts itself: its cases do not say what it says of them")
    return Record(file=file, table=table)


def find_records(folder: Path) -> Iterable[Path]:
    """Files of records in a folder, newest first."""
    files = [file for file in folder.glob("*.json") if file.is_file()] if folder.is_dir() else []
    return sorted(files, key=lambda file: file.stat().st_mtime, reverse=True)


def of_subject(files: Iterable[Path], sha256: str) -> list[Path]:
    """Files that claim to be of a configuration."""
    return [file for file in files if file.name.startswith(sha256[:_SHORT])]


def _plan_table(plan: Plan) -> dict[str, Any]:
    return {"speed": plan.speed, "gait": plan.gait, "seeds": plan.seeds, "quick": plan.quick}


def _case(verdict: Verdict) -> dict[str, Any]:
    case = verdict.case
    options = {key: value for key, value in case.options.items() if key != "config"}
    return {
        "name": case.name,
        "scenario": case.scenario,
        "options": options,
        "passed": verdict.passed,
        "limits": [_limit(limit, verdict) for limit in case.limits],
        "figures": {str(seed): figures for seed, figures in verdict.figures.items()},
    }


def _limit(limit: Limit, verdict: Verdict) -> dict[str, Any]:
    return {
        "figure": limit.figure, "bound": limit.bound, "side": limit.side, "unit": limit.unit,
        "over": limit.over, "share": limit.share, "text": f"{limit.figure} {limit.describe()}",
        "value": verdict.value(limit), "holds": verdict.holds(limit),
    }  # fmt: skip


def _passes(cases: Sequence[Mapping[str, Any]]) -> bool:
    """Whether the figures of all cases keep their limits, judged anew."""
    return bool(cases) and all(_judged(case, row) for case in cases for row in case["limits"])


def _judged(case: Mapping[str, Any], row: Mapping[str, Any]) -> bool:
    keys = ("figure", "bound", "side", "unit", "over", "share")
    limit = Limit(**{key: row[key] for key in keys})
    return limit.holds([figures.get(limit.figure) for figures in case["figures"].values()])


def _seen(limit: Mapping[str, Any]) -> str:
    value = limit["value"]
    return "not measured" if value is None else f"{value:.3g} {limit['unit']}".rstrip()
