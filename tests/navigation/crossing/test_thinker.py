"""Work beside the ticks."""

import threading

import pytest

from bluefoot_mpc.navigation.crossing.thinker import Thinker


def test_a_result_comes_on_its_tick_and_not_before():
    thinker = Thinker(3)
    assert thinker.step() is None
    thinker.start(lambda: 7)
    assert thinker.busy
    assert [thinker.step() for _ in range(4)] == [None, None, 7, None]
    assert not thinker.busy


def test_slow_work_is_waited_for():
    thinker, go = Thinker(2), threading.Event()
    thinker.start(lambda: go.wait(5.0))
    assert thinker.step() is None
    threading.Timer(0.05, go.set).start()
    assert thinker.step() is True


def test_an_error_is_raised_on_the_tick_that_asks():
    thinker = Thinker(1)
    thinker.start(lambda: 1 // 0)
    with pytest.raises(ZeroDivisionError):
        thinker.step()
    assert not thinker.busy


def test_what_was_forgotten_is_never_heard():
    thinker, go = Thinker(1), threading.Event()
    thinker.start(lambda: go.wait(5.0) and "old")
    thinker.start(lambda: "new")
    assert thinker.step() == "new"
    thinker.start(lambda: "newest")
    thinker.reset()
    go.set()
    assert thinker.step() is None
