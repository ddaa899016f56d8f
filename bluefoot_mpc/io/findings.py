"""What a check of a device finds: the part, the finding, and how to mend it."""

from __future__ import annotations

import enum
from collections.abc import Sequence
from dataclasses import dataclass

from bluefoot_mpc.exceptions import DeviceError

_NAMED = 4
"""Parts that are named one by one."""


class Severity(enum.IntEnum):
    """How much a finding matters; higher is worse."""

    OK = 0
    NOTE = 1
    WARNING = 2
    REFUSAL = 3


@dataclass(frozen=True, kw_only=True, slots=True)
class Finding:
    """One line of a check.

    Attributes:
        part: what was checked, e.g. ``"servo 7 (FR_knee)"`` or ``"port /dev/ttyUSB0"``.
        text: what was found, with the value.
        mend: what to do about it; empty where nothing is to do.
        severity: refusals keep the torque off.
    """

    part: str
    text: str
    mend: str = ""
    severity: Severity = Severity.OK

    def __str__(self) -> str:
        """The finding as one sentence with its way out."""
        return f"{self.part}: {self.text}" + (f". {self.mend}" if self.mend else "")


class NotArmedError(DeviceError):
    """The robot was not armed, and no torque is on.

    Args:
        findings: why; those that refuse are named.
    """

    def __init__(self, findings: Sequence[Finding]) -> None:
        self.findings = tuple(findings)
        bad = [finding for finding in findings if finding.severity is Severity.REFUSAL]
        super().__init__("not armed, no torque is on:\n  " + "\n  ".join(_grouped(bad)))


def _grouped(findings: Sequence[Finding]) -> list[str]:
    """A line for each thing that is wrong; parts with the same trouble share one."""
    parts: dict[tuple[str, str], list[str]] = {}
    for finding in findings:
        parts.setdefault((finding.text, finding.mend), []).append(finding.part)
    lines = []
    for (text, mend), named in parts.items():
        shown = (
            ", ".join(named)
            if len(named) <= _NAMED
            else f"{', '.join(named[:2])} … {named[-1]}, {len(named)} in all"
        )
        lines.append(str(Finding(part=shown, text=text, mend=mend)))
    return lines
