import numpy as np

from bluefoot_mpc.estimation.contacts import advance_switches, initial_switches

ALL = np.ones(4, dtype=bool)


def run(signal: list[int], valid: np.ndarray = ALL, debounce: float = 0.03) -> list[int]:
    state, seen = initial_switches(), []
    for value in signal:
        state = advance_switches(state, np.array([bool(value)] * 4), valid, 0.02, debounce)
        seen.append(int(state.contact[0]))
    return seen


def test_an_edge_passes_at_once():
    assert run([0, 1, 1, 1, 0, 0]) == [0, 1, 1, 1, 0, 0]


def test_one_chatter_is_removed():
    assert run([0, 0, 1, 0, 1, 1, 1]) == [0, 0, 1, 1, 1, 1, 1]
    assert run([1, 1, 1, 0, 1, 0, 0]) == [1, 1, 1, 0, 0, 0, 0]


def test_a_broken_switch_counts_as_open():
    assert run([1, 1, 1], ~ALL) == [0, 0, 0]


def test_without_debouncing_the_raw_signal_comes_back():
    assert run([1, 0, 1, 0], debounce=0.0) == [1, 0, 1, 0]
