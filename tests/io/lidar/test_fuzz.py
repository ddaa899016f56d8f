"""Damage on the line: nothing but typed errors, and nothing taken that a sum refuses."""

import random

import pytest

from .damage import fuzz


@pytest.mark.parametrize("seed", [1, 2])
def test_five_hundred_damaged_scans(seed):
    count = fuzz(500, random.Random(seed))
    assert count.accepted + count.refused + count.lost == 500
    assert count.wrong_sum == 0
    assert count.intact_refused == 0
    assert count.accepted > 100
    assert count.refused > 50


@pytest.mark.slow
def test_ten_thousand_damaged_scans():
    count = fuzz(10_000, random.Random(0))
    assert count.wrong_sum == count.intact_refused == 0
