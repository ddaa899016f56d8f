import math

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError
from bluefoot_mpc.wheels.wheel import (
    Wheel,
    axis_direction,
    castor_rate,
    contact,
    roller_speed,
    rolling_direction,
    rolling_row,
    sliding_row,
    wheel_speed,
)

ANGLES = [(0.0, 0.0), (math.pi / 2, 0.0), (-math.pi / 2, math.pi), (0.7, -1.2), (-2.5, 0.4)]


def contact_velocity(wheel, twist, steering=0.0, steering_rate=0.0, h=1e-6):
    """Velocity of the contact in the robot's frame at this moment, from where it is before and after."""

    def place(t):
        turn = twist[2] * t
        c, s = math.cos(turn), math.sin(turn)
        return twist[:2] * t + np.array([[c, -s], [s, c]]) @ contact(wheel, steering + steering_rate * t)

    return (place(h) - place(-h)) / (2 * h)


@pytest.mark.parametrize(("alpha", "beta"), ANGLES)
def test_axis_and_rolling_direction_are_the_documents_vectors(alpha, beta):
    wheel = Wheel(kind="fixed", alpha=alpha, beta=beta, length=0.1)
    np.testing.assert_allclose(
        axis_direction(wheel), [math.cos(alpha + beta), math.sin(alpha + beta)], atol=1e-15
    )
    np.testing.assert_allclose(
        rolling_direction(wheel), [math.sin(alpha + beta), -math.cos(alpha + beta)], atol=1e-15
    )


@pytest.mark.parametrize(("alpha", "beta"), ANGLES)
@pytest.mark.parametrize("kind", ["fixed", "steered"])
def test_rows_of_standard_wheels_project_the_contacts_velocity(kind, alpha, beta):
    wheel = Wheel(kind=kind, alpha=alpha, beta=beta, length=0.13)
    steering = 0.6 if kind == "steered" else 0.0
    twist = np.array([0.3, -0.2, 0.9])
    velocity = contact_velocity(wheel, twist, steering)
    assert rolling_row(wheel, steering) @ twist == pytest.approx(
        rolling_direction(wheel, steering) @ velocity, abs=1e-9
    )
    assert sliding_row(wheel, steering) @ twist == pytest.approx(
        axis_direction(wheel, steering) @ velocity, abs=1e-9
    )
    b = beta + steering
    np.testing.assert_allclose(
        rolling_row(wheel, steering), [math.sin(alpha + b), -math.cos(alpha + b), -0.13 * math.cos(b)]
    )
    np.testing.assert_allclose(
        sliding_row(wheel, steering), [math.cos(alpha + b), math.sin(alpha + b), 0.13 * math.sin(b)]
    )


@pytest.mark.parametrize("offset", [0.03, -0.02])
@pytest.mark.parametrize(("alpha", "beta"), ANGLES)
def test_a_castor_swings_so_that_its_contact_does_not_slide(alpha, beta, offset):
    wheel = Wheel(kind="castor", alpha=alpha, beta=beta, length=0.1, offset=offset)
    twist, steering = np.array([0.2, 0.1, -0.7]), 0.4
    rate = castor_rate(wheel, twist, steering)
    velocity = contact_velocity(wheel, twist, steering, rate)
    assert axis_direction(wheel, steering) @ velocity == pytest.approx(0.0, abs=1e-9)
    speed = wheel_speed(wheel, twist, steering) * wheel.radius
    assert rolling_direction(wheel, steering) @ velocity == pytest.approx(speed, abs=1e-9)
    # The document's row: the offset is added to L sin(beta), and plays no part in rolling.
    assert sliding_row(wheel, steering)[2] == pytest.approx(offset + 0.1 * math.sin(beta + steering))
    assert rolling_row(wheel, steering)[2] == pytest.approx(-0.1 * math.cos(beta + steering))


@pytest.mark.parametrize("gamma", [0.0, math.pi / 4, -math.pi / 4, 1.0])
def test_swedish_wheel_and_its_roller_together_move_the_contact(gamma):
    wheel = Wheel(
        kind="swedish", alpha=0.8, beta=-0.3, gamma=gamma, length=0.12, radius=0.04, roller_radius=0.007
    )
    twist = np.array([0.25, -0.4, 1.1])
    velocity = contact_velocity(wheel, twist)
    # The wheel carries the contact along v, a roller across its own axis, which is v turned by gamma.
    across = np.array([math.cos(0.5 + gamma), math.sin(0.5 + gamma)])
    parts = np.linalg.solve(np.column_stack([rolling_direction(wheel), across]), velocity)
    assert wheel_speed(wheel, twist) == pytest.approx(parts[0] / 0.04, abs=1e-7)
    assert roller_speed(wheel, twist) == pytest.approx(parts[1] / 0.007, abs=1e-6)


def test_swedish_rows_are_the_documents_with_gamma_added():
    wheel = Wheel(kind="swedish", alpha=0.8, beta=-0.3, gamma=0.6, length=0.12, radius=0.04)
    whole = 0.8 - 0.3 + 0.6
    np.testing.assert_allclose(rolling_row(wheel), [math.sin(whole), -math.cos(whole), -0.12 * math.cos(0.3)])
    np.testing.assert_allclose(sliding_row(wheel), [math.cos(whole), math.sin(whole), 0.12 * math.sin(0.3)])
    assert wheel.drive_radius == pytest.approx(0.04 * math.cos(0.6))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"kind": "caster"}, "castor"),
        ({"kind": "castor"}, "offset = 0"),
        ({"offset": 0.01}, "for castors"),
        ({"gamma": 0.3}, "for Swedish wheels"),
        ({"kind": "swedish", "gamma": math.pi / 2}, "no hold on the floor"),
        ({"alpha": math.nan}, "finite"),
        ({"length": -0.1}, "negative"),
        ({"radius": 0.0}, "positive"),
        ({"kind": "swedish", "roller_radius": 0.0}, "positive"),
    ],
)
def test_impossible_wheels_are_refused_with_the_cause(changes, words):
    with pytest.raises(ConfigurationError, match=words):
        Wheel(**({"kind": "fixed", "alpha": 0.0} | changes))


def test_rates_of_wheels_that_have_none_are_refused():
    with pytest.raises(ConfigurationError, match="only a castor"):
        castor_rate(Wheel(kind="fixed", alpha=0.0), np.zeros(3), 0.0)
    with pytest.raises(ConfigurationError, match="only a Swedish"):
        roller_speed(Wheel(kind="fixed", alpha=0.0), np.zeros(3))
    with pytest.raises(UnknownNameError):
        Wheel(kind="wooden", alpha=0.0)
