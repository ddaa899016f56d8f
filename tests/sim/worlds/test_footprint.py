"""Distances in the plane, against geometry by hand."""

import math

import numpy as np
import pytest

from bluefoot_mpc.sim.worlds import footprint
from bluefoot_mpc.sim.worlds.plan import Solid


def box(name="box", x=0.0, y=0.0, size=(1.0, 0.4, 0.5), yaw=0.0, z=0.25):
    return Solid(name=name, shape="box", x=x, y=y, z=z, size=size, yaw=yaw)


def cylinder(name="post", x=0.0, y=0.0, radius=0.2, height=0.5):
    return Solid(name=name, shape="cylinder", x=x, y=y, z=0.5 * height, size=(2 * radius, 2 * radius, height))


def test_distance_from_a_box():
    points = np.array([[0.8, 0.0], [0.0, 0.5], [0.8, 0.6], [0.0, 0.0]])
    assert footprint.distance(points, box()) == pytest.approx([0.3, 0.3, 0.5, -0.2])


def test_distance_from_a_turned_box():
    turned = box(x=1.0, y=2.0, yaw=math.radians(90.0))
    assert footprint.distance(np.array([[1.5, 2.0], [1.0, 2.8]]), turned) == pytest.approx([0.3, 0.3])


def test_distance_from_a_cylinder():
    assert footprint.distance(np.array([[0.3, 0.4], [0.0, 0.1]]), cylinder()) == pytest.approx([0.3, -0.1])


def test_gaps():
    assert footprint.gap(cylinder(), cylinder("b", x=1.0)) == pytest.approx(0.6, abs=1e-3)
    assert footprint.gap(box(), cylinder(x=0.5 + 0.3, y=0.2 + 0.4)) == pytest.approx(0.3, abs=1e-3)
    crossed = footprint.gap(box(), box("b", yaw=math.radians(90.0)))
    assert crossed < 0.0


def test_are_apart_agrees_with_the_gap():
    rng = np.random.default_rng(0)
    for _ in range(100):
        one = box(yaw=rng.uniform(-3, 3))
        other = box("b", x=rng.uniform(-2, 2), y=rng.uniform(-2, 2), yaw=rng.uniform(-3, 3))
        assert footprint.are_apart(one, other, 0.5) == (footprint.gap(one, other) >= 0.5)


def test_what_hangs_is_not_in_the_way():
    seat, leg = box("seat", z=0.70), cylinder("leg")
    assert footprint.in_the_way([seat, leg]) == (leg,)
    assert footprint.crossing([seat, leg], 0.25) == (leg,)
    assert footprint.crossing([seat, leg], 0.60) == (seat,)


def test_without_solids_everything_is_far():
    assert np.isinf(footprint.nearest(np.zeros((2, 2)), [])).all()
