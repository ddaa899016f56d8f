"""Clocks of devices, and when a lost port is tried again."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bluefoot_mpc.io.device_time import ClockOffset, Counter
from bluefoot_mpc.io.retry import Retry


@given(st.integers(0, 2**24 - 1), st.lists(st.integers(-(2**22), 2**22), max_size=30))
def test_a_counter_never_wraps(start, steps):
    counter = Counter(24, 0.001)
    first = counter.seconds(start)
    total = start
    for step in steps:
        total += step
        assert counter.seconds(total % 2**24) - first == pytest.approx(0.001 * (total - start), abs=1e-6)


def test_the_shortest_way_within_the_window_counts():
    offset = ClockOffset(1.0)
    assert not offset.known
    for time, delay in ((0.0, 5.02), (0.1, 5.005), (0.2, 5.03)):
        offset.observe(delay, time)
    assert offset.least == 5.005
    offset.observe(5.01, 1.15)
    assert offset.least == 5.01
    offset.reset()
    assert (offset.known, offset.least) == (False, 0.0)


def test_waits_double_until_the_longest_and_begin_anew_after_good_data():
    retry = Retry(0.1, 0.5)
    waits = []
    now = 0.0
    for _ in range(5):
        retry.begin(now)
        began = now
        while not retry.is_due(now):
            now += 0.01
        waits.append(now - began)
    assert waits == pytest.approx([0.1, 0.2, 0.4, 0.5, 0.5], abs=0.011)
    retry.settled()
    retry.begin(0.0)
    assert retry.is_due(0.11)
