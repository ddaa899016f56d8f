import pytest

from bluefoot_mpc.wheels.machines import MACHINES


def test_the_documents_figures():
    p2, ohio, lauron = MACHINES["Honda P2"], MACHINES["Ohio State hexapod"], MACHINES["Lauron II"]
    assert p2.speed * 3.6 == pytest.approx(2.0)
    assert (p2.autonomy / 60, p2.mass, p2.height) == (15.0, 210.0, 1.82)
    assert p2.joints == 2 * 6 + 2 * 7
    assert (ohio.speed, ohio.mass, ohio.height, ohio.length, ohio.legs) == (2.3, 3200.0, 3.0, 5.2, 6)
    assert ohio.joints == lauron.joints == 6 * 3
    assert (lauron.speed, lauron.mass, lauron.height, lauron.length, lauron.power) == (
        0.5,
        6.0,
        0.3,
        0.7,
        10.0,
    )


def test_cost_of_transport_where_all_figures_are_given():
    assert MACHINES["Lauron II"].cost_of_transport == pytest.approx(10.0 / (6.0 * 9.81 * 0.5))
    assert MACHINES["Honda P2"].cost_of_transport is None
