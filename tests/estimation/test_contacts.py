import numpy as np

from bluefoot_mpc.estimation.contacts import SwitchState, advance_switches, initial_switches, lifting_feet

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


def switches(**ages: float) -> SwitchState:
    """Feet FL, FR, RL, RR that have stood for `ages` (s); others are in the air."""
    names = ("FL", "FR", "RL", "RR")
    contact = tuple(name in ages for name in names)
    return SwitchState(contact, tuple(ages.get(name, 0.05) for name in names), contact)


def test_the_pair_that_has_stood_longest_lifts_when_the_other_lands():
    assert lifting_feet(switches(FL=0.21, RR=0.19), 0.12) == [False] * 4
    assert lifting_feet(switches(FL=0.21, RR=0.19, FR=0.0), 0.12) == [True, False, False, True]
    assert lifting_feet(switches(FL=0.31, RR=0.29, FR=0.1, RL=0.1), 0.12) == [True, False, False, True]
    # They have not lifted in that time: the robot stands.
    assert lifting_feet(switches(FL=0.41, RR=0.39, FR=0.2, RL=0.2), 0.12) == [False] * 4


def test_only_the_oldest_of_a_walks_feet_lifts():
    assert lifting_feet(switches(FL=0.9, FR=0.6, RL=0.3, RR=0.02), 0.12) == [True, False, False, False]


def test_the_first_feet_to_touch_do_not_lift():
    assert lifting_feet(switches(FL=0.02, FR=0.02, RL=0.0), 0.12) == [False] * 4
    assert lifting_feet(initial_switches(), 0.12) == [False] * 4
