"""Makes ``docs/faults.md`` from the table: ``python -m tests.faults.document``."""

from __future__ import annotations

import re
from pathlib import Path

from tests.faults.table import CASES, TRIED, Case, Tried

PAGE = Path(__file__).parents[2] / "docs" / "faults.md"
_HEAD = """# Faults, and what the robot does about them

Every fault below is injected into the whole robot while it trots (`--robot emulator`: drivers, supervisor,
controller and loop are those of a real run; servos, board, LIDAR and world are emulated), and a test checks
what the robot does. Faults in code font are those of a fault plan ([emulator.md](emulator.md)). Times are in
seconds: the robot is armed at 1.4 and trots from 2.4 on. Tables are those of the tests
(`python -m tests.faults.document`).

Whatever the fault, each of these tests requires: periods of 1/45 s at most, no write to permanent memory, no
violation of the bus protocol by the driver (a line that damages or delays requests makes some itself), no
torque and no power at the end, no goal after the torque is off, and that a servo which has lost its torque
does not get it back. Thresholds and orders of stopping are in [safety.md](safety.md).

A robot that "walks on" makes three quarters of its speed at least and tilts by less than 4°, one that "stops
walking" does so by itself and tilts no more, one that "sits down" does not fall and keeps its torque, and one
that "sinks" does so with less than 0.3 m/s.
"""


def page() -> str:
    """The whole page."""
    parts = [_HEAD]
    for section, cases in CASES.items():
        parts.append(f"## {section}\n\n| fault | injected | the robot | it says |\n|---|---|---|---|")
        parts.append("\n".join(_case(case) for case in cases) + "\n")
    parts.append(
        "## Program, radio, emergency stop\n\n| fault | the robot | checked by |\n|---|---|---|\n"
        + "\n".join(_tried(tried) for tried in TRIED)
    )
    return "\n".join(parts) + "\n"


def _case(case: Case) -> str:
    told = "; ".join((*case.says, *((case.logs,) if case.logs else ())))
    return f"| {case.name} | {case.injected} | {case.reaction.value} | {told} |"


def _tried(tried: Tried) -> str:
    tests = ", ".join(f"`{re.sub('^tests/', '', name).replace('::', ' ')}`" for name in tried.tests)
    return f"| {tried.name} | {tried.reaction} | {tests} |"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
