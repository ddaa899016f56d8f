"""When the compensator acts, and when the network may learn."""

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from bluefoot_mpc.leveling import schedule
from bluefoot_mpc.leveling.config import ScheduleConfig

TICK = 0.02
LENGTHS = st.integers(1, 1000).map(lambda ticks: ticks * TICK)
STARTS = st.integers(0, 500).map(lambda ticks: ticks * TICK)


@given(start=STARTS, off=LENGTHS, on=LENGTHS, number=st.integers(0, 20), share=st.floats(0.0, 1.0))
def test_windows_follow_one_another_off_first(start, off, on, number, share):
    config = ScheduleConfig(start=start, off=off, on=on)
    begin = start + number * (off + on)
    inside = 1e-5 + share * (1.0 - 1e-3)
    assert not schedule.wants_on(begin + inside * (off - 2e-5), config)
    assert schedule.wants_on(begin + off + inside * (on - 2e-5), config)


@given(start=STARTS, off=LENGTHS, on=LENGTHS, number=st.integers(0, 20))
def test_the_edge_of_a_window_belongs_to_what_follows(start, off, on, number):
    config = ScheduleConfig(start=start, off=off, on=on)
    begin = start + number * (off + on)
    assert not schedule.wants_on(begin, config)
    assert schedule.wants_on(begin + off, config)
    assert not schedule.wants_on(begin + off - TICK, config)
    assert schedule.wants_on(begin + off + on - TICK, config)


@given(off=st.integers(1, 600), on=st.integers(1, 600))
def test_every_period_has_its_number_of_ticks_however_times_are_added_up(off, on):
    config = ScheduleConfig(off=off * TICK, on=on * TICK)
    time, ticks = 0.0, 0
    for _ in range(3 * (off + on)):
        ticks += schedule.wants_on(time, config)
        time += TICK
    assert ticks == 3 * on


@given(start=STARTS, off=st.floats(0.0, 20.0), on=st.floats(0.0, 20.0), time=st.floats(0.0, 500.0))
def test_before_the_start_it_never_acts(start, off, on, time):
    assume(time < start - 1e-5)
    assert not schedule.wants_on(time, ScheduleConfig(start=start, off=off, on=on))


@given(start=STARTS, off=st.floats(0.0, 20.0), later=st.floats(0.0, 500.0))
def test_without_on_windows_it_acts_for_good_after_the_first_off_window(start, off, later):
    config = ScheduleConfig(start=start, off=off, on=0.0)
    assert schedule.wants_on(start + off + later, config)
    assume(off > 1e-3)
    assert not schedule.wants_on(start + off - 1e-3, config)


@given(on=LENGTHS, later=st.floats(0.0, 500.0))
def test_without_off_windows_it_acts_all_the_time(on, later):
    assert schedule.wants_on(later, ScheduleConfig(on=on))


@pytest.mark.parametrize(
    ("learn", "acts", "may"),
    [
        ("off", False, True), ("off", True, False),
        ("always", False, True), ("always", True, True),
        ("never", False, False), ("never", True, False),
    ],
)  # fmt: skip
def test_when_the_network_may_learn(learn, acts, may):
    assert schedule.may_learn(acts, ScheduleConfig(learn=learn)) is may


@given(fade=st.floats(0.001, 2.0), dt=st.floats(0.001, 0.1))
def test_a_fade_takes_its_time_and_ends_exactly(fade, dt):
    config = ScheduleConfig(fade=fade)
    share, ticks = 0.0, 0
    while share < 1.0:
        before, share, ticks = share, schedule.faded(share, True, dt, config), ticks + 1
        assert before < share <= 1.0
    assert (ticks - 1) * dt <= fade * (1.0 + 1e-9)
    assert ticks * dt >= fade * (1.0 - 1e-9)
    for _ in range(ticks + 1):
        share = schedule.faded(share, False, dt, config)
    assert share == 0.0


def test_a_fade_turns_round_where_it_is():
    config = ScheduleConfig(fade=0.1)
    share = schedule.faded(0.5, False, 0.02, config)
    assert schedule.faded(share, True, 0.02, config) == pytest.approx(0.5)
