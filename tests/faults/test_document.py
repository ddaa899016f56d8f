"""The page of faults is up to date and complete, and what it refers to exists."""

import ast
from pathlib import Path

import pytest

from tests.faults.document import PAGE, page
from tests.faults.table import CASES, TRIED

ROOT = Path(__file__).parents[2]
REQUIRED = (
    "one lost reply", "10 % random loss", "bad checksum", "corrupt byte", "corrupt length", "wrong ID",
    "duplicate reply", "60 ms late", "garbage around packets", "split reply", "short status", "range-error",
    "continuous babble", "unplugged in stance", "plugged in again", "overheated", "overload", "voltage ramp",
    "voltage step", "brown-out", "power switch stuck", "USB lost for 0.7 s and back", "adapter stall 200 ms",
    "latency timer 16 ms", "corrupted sync write", "wrong baud", "duplicate ID", "missing ID", "wrong model",
    "changed EEPROM", "emits NaN", "500-tick step", "out-of-limit goals", "control thread hung",
    "process killed", "radio silent", "10 % corrupt", "commands stop but heartbeats go on",
    "replayed commands", "blocked radio writer", "IMU silent", "IMU frozen", "IMU NaN", "IMU time jump",
    "foot switch stuck", "foot switch chattering", "LIDAR bad sum", "LIDAR truncated", "LIDAR silent",
    "LIDAR hung up", "wall clock jump", "emergency stop in every state, twice",
)  # fmt: skip


def test_the_page_is_made_from_the_table():
    text = page()
    assert PAGE.read_text(encoding="utf-8") == text, "run: python -m tests.faults.document"


@pytest.mark.parametrize("name", REQUIRED)
def test_every_fault_is_in_the_table(name):
    names = [case.name for cases in CASES.values() for case in cases] + [tried.name for tried in TRIED]
    assert any(name in known for known in names)


def test_names_are_all_different():
    names = [case.name for cases in CASES.values() for case in cases]
    assert len(set(names)) == len(names)


@pytest.mark.parametrize("reference", sorted({test for tried in TRIED for test in tried.tests}))
def test_what_is_referred_to_exists(reference):
    file, name = reference.split("::")
    tree = ast.parse((ROOT / file).read_text(encoding="utf-8"))
    assert name in {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}
