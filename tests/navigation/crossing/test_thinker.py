"""Work beside the ticks."""

import threading

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


def test_an_error_is_told_on_the_tick_that_asks_and_forgotten_with_the_next_work():
    thinker = Thinker(2)
    thinker.start(lambda: 1 // 0)
    assert thinker.step() is None
    assert not thinker.failure
    assert thinker.step() is None
    assert "ZeroDivisionError" in thinker.failure
    assert not thinker.busy
    thinker.start(lambda: 7)
    assert not thinker.failure


def test_what_was_forgotten_is_never_heard():
    thinker, go = Thinker(1), threading.Event()
    thinker.start(lambda: go.wait(5.0) and "old")
    thinker.start(lambda: "new")
    assert thinker.step() == "new"
    thinker.start(lambda: "newest")
    thinker.reset()
    go.set()
    assert thinker.step() is None
