import gc
import weakref

from bluefoot_mpc.runtime.garbage import INTERVAL, YoungCollection


class Node:
    """An object that keeps itself alive."""

    def __init__(self):
        self.me = self


def test_full_collections_wait_until_the_end():
    generations = []

    def spy(phase, info):
        if phase == "start":
            generations.append(info["generation"])

    gc.callbacks.append(spy)
    try:
        with YoungCollection() as garbage:
            for _ in range(4 * INTERVAL):
                kept = [[] for _ in range(1000)]
                garbage.tick()
            assert generations == [1] * 4
            assert not gc.isenabled()
    finally:
        gc.callbacks.remove(spy)
    assert gc.isenabled()
    assert len(kept) == 1000


def test_young_cycles_are_freed_inside_the_loop():
    with YoungCollection() as garbage:
        lost = weakref.ref(Node())
        assert lost() is not None
        for _ in range(INTERVAL):
            garbage.tick()
        assert lost() is None


def test_a_switched_off_collector_stays_off():
    gc.disable()
    try:
        with YoungCollection() as garbage:
            lost = weakref.ref(Node())
            for _ in range(2 * INTERVAL):
                garbage.tick()
            assert lost() is not None
        assert not gc.isenabled()
    finally:
        gc.enable()


def test_the_collector_comes_back_after_an_error():
    try:
        with YoungCollection():
            raise ValueError
    except ValueError:
        assert gc.isenabled()
