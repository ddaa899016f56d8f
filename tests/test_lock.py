"""The lock fits pyproject.toml; what would be wrong with it is noticed."""

import runpy
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
CHECK = runpy.run_path(str(ROOT / ".ci" / "check_lock.py"))
LOCK = (ROOT / "requirements.lock").read_text(encoding="utf-8")


def problems(lock, *lines):
    return CHECK["problems"](lock, [CHECK["Requirement"](line) for line in lines])


def test_the_lock_is_in_order():
    assert CHECK["main"]() == 0


@pytest.mark.parametrize(
    ("lock", "need", "sentence"),
    [
        (LOCK, "numpy>=99", "does not fit"),
        (LOCK, "frobnicate>=1", "is missing"),
        ("numpy==2.4.6\n", "numpy", "has no hash"),
        ("--index-url https://example.org/simple\n" + LOCK, "numpy", "an address"),
        ("-e .\n" + LOCK, "numpy", "not a pin"),
    ],
)
def test_what_is_wrong_is_noticed(lock, need, sentence):
    assert any(sentence in line for line in problems(lock, need))
