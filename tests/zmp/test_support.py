"""Support regions against the plain geometry of hulls."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.geometry import convex_hull, signed_margin
from bluefoot_mpc.types import ContactSchedule
from bluefoot_mpc.zmp.support import FAR, SupportConfig, SupportPreview, support_margins

CORNERS = np.array([[0.165, 0.165], [0.165, -0.165], [-0.165, 0.165], [-0.165, -0.165]])


def schedule(feet, stance):
    feet, stance = np.asarray(feet, dtype=float), np.asarray(stance, dtype=bool)
    places = np.concatenate([feet, np.zeros((len(feet), 4, 1))], axis=2)
    return ContactSchedule(time=0.04 * np.arange(1, len(feet) + 1), stance=stance, footholds=places)


def build(feet, stance, **config):
    preview = SupportPreview(SupportConfig(**config), len(feet))
    return preview, preview.build(schedule(feet, stance))


def scattered(rng, n):
    """Feet near their places and anywhere: hulls of four, crossed and interior feet."""
    spread = rng.choice([0.01, 0.05, 0.3], size=(n, 1, 1))
    return CORNERS + spread * rng.normal(size=(n, 4, 2))


def hull_margin(point, feet, stance):
    return signed_margin(point, convex_hull(feet[stance]))


@pytest.mark.parametrize("least_feet", [1, 2, 3, 4])
def test_margins_are_those_of_the_hull(least_feet):
    rng = np.random.default_rng(least_feet)
    n = 700  # more than one chunk
    feet, stance = scattered(rng, n), rng.random((n, 4)) < 0.75
    points = 0.2 * rng.normal(size=(n, 2))
    points[5] = np.nan
    margins = support_margins(points, feet, stance, least_feet)
    usable = stance.sum(axis=1) >= least_feet
    usable[5] = False
    assert np.array_equal(np.isfinite(margins), usable)
    wanted = [hull_margin(points[k], feet[k], stance[k]) for k in np.flatnonzero(usable)]
    assert margins[usable] == pytest.approx(np.array(wanted), abs=1e-12)


coordinate = st.integers(-30, 30).map(lambda k: 0.01 * k)
place = st.tuples(coordinate, coordinate)


@settings(max_examples=150, deadline=None)
@given(
    feet=st.lists(place, min_size=4, max_size=4),
    stance=st.lists(st.booleans(), min_size=4, max_size=4).filter(any),
    point=place,
)
def test_margins_hold_on_a_grid_where_feet_meet_and_line_up(feet, stance, point):
    feet, stance, point = np.array(feet), np.array(stance), np.array(point)
    margin = support_margins(point[None], feet[None], stance[None], least_feet=1)[0]
    assert margin == pytest.approx(hull_margin(point, feet, stance), abs=1e-9)


def test_rows_keep_points_by_the_margin_inside():
    rng = np.random.default_rng(3)
    n, margin = 400, 0.02
    stance = np.ones((n, 4), dtype=bool)
    stance[np.arange(n), rng.integers(4, size=n)] = rng.random(n) < 0.5
    feet = CORNERS + 0.03 * rng.normal(size=(n, 4, 2))
    preview, support = build(feet, stance, margin=margin)
    points = 0.1 * rng.normal(size=(n, 2))
    inside = (np.einsum("nij,nj->ni", support.normals, points) <= support.offsets).all(axis=1)
    assert np.array_equal(inside, preview.margins(points) >= margin)
    assert 0.1 < inside.mean() < 0.9


@settings(max_examples=100, deadline=None)
@given(
    feet=st.lists(place, min_size=4, max_size=4),
    stance=st.lists(st.booleans(), min_size=4, max_size=4).filter(any),
    margin=st.floats(0.0, 1.0),
)
def test_a_region_that_the_margin_eats_shrinks_to_its_centre(feet, stance, margin):
    _, support = build([feet], [stance], margin=margin)
    centre = np.array(feet)[np.array(stance)].mean(axis=0)
    assert support.centre[0] == pytest.approx(centre, abs=1e-12)
    # That of a strip is the middle between its ends, not the mean of three feet on a line.
    places = centre, support.edges[0, 0].mean(axis=0)
    assert max((support.offsets[0] - support.normals[0] @ place).min() for place in places) >= -1e-9


def test_two_feet_give_a_strip_that_ends_before_them():
    feet, stance = [CORNERS], [[True, False, False, True]]
    preview, support = build(feet, stance, margin=0.01, half_width=0.004)
    along = np.array([1.0, 1.0]) / np.sqrt(2.0)
    across = np.array([1.0, -1.0]) / np.sqrt(2.0)
    half = 0.165 * np.sqrt(2.0)
    for point, wanted in (
        (0.0 * along, 0.004),
        (0.0039 * across, 0.0001),
        (0.0041 * across, -0.0001),
        ((half - 0.005) * along, 0.0 - 0.005 + 0.004),
    ):
        inside = (support.offsets[0] - support.normals[0] @ point).min()
        assert inside == pytest.approx(wanted, abs=1e-12)
    assert preview.margins(0.02 * across[None])[0] == pytest.approx(-0.02)


def test_three_feet_on_a_line_count_as_two():
    feet = np.array([[[0.1, 0.1], [0.0, 0.0], [0.5, -0.5], [-0.2, -0.2]]])
    preview, support = build(feet, [[True, True, False, True]], margin=0.0, half_width=0.01)
    across = np.array([1.0, -1.0]) / np.sqrt(2.0)
    assert (support.offsets[0] - support.normals[0] @ (0.02 * across)).min() == pytest.approx(-0.01)
    assert (support.offsets[0] - support.normals[0] @ np.array([-0.19, -0.19])).min() > 0.0
    assert preview.margins(np.array([[0.3, 0.3]]))[0] == pytest.approx(-0.2 * np.sqrt(2.0))


def test_one_foot_gives_a_box():
    _, support = build([CORNERS], [[False, True, False, False]], half_width=0.003)
    reach = support.offsets[0] - support.normals[0] @ CORNERS[1]
    assert reach == pytest.approx(np.full(4, 0.003))
    assert np.abs(support.normals[0].sum(axis=0)).max() < 1e-12


def test_spare_rows_lie_far_away():
    _, support = build([CORNERS], [[True, True, True, False]])
    assert np.sort(support.offsets[0])[-1] == FAR
    assert np.linalg.norm(support.normals[0], axis=1) == pytest.approx(np.ones(4))


def test_samples_without_a_foot_repeat_the_region_before_them():
    stance = np.ones((5, 4), dtype=bool)
    stance[0] = stance[2] = stance[3] = False
    stance[1, 0] = False
    feet = CORNERS + 0.01 * np.arange(5)[:, None, None]
    _, support = build(feet, stance)
    assert support.valid.tolist() == [False, True, False, False, True]
    for k in (0, 2, 3):
        assert np.array_equal(support.offsets[k], support.offsets[1])
        assert np.array_equal(support.edges[k], support.edges[1])
    assert not np.array_equal(support.offsets[4], support.offsets[1])


def test_a_schedule_without_any_foot_says_so():
    _, support = build([CORNERS] * 3, np.zeros((3, 4), dtype=bool))
    assert not support.valid.any()
    assert np.isfinite(support.offsets).all()


def test_regions_turn_and_move_with_the_feet():
    rng = np.random.default_rng(8)
    feet, stance = scattered(rng, 200), rng.random((200, 4)) < 0.75
    points = 0.2 * rng.normal(size=(200, 2))
    c, s = np.cos(0.7), np.sin(0.7)
    turn = np.array([[c, -s], [s, c]])
    moved = support_margins(points @ turn.T + [2.0, -1.0], feet @ turn.T + [2.0, -1.0], stance)
    margins = support_margins(points, feet, stance)
    assert moved == pytest.approx(margins, abs=1e-9, nan_ok=True)


def test_bad_sizes_and_margins_are_refused():
    with pytest.raises(ConfigurationError, match="at least one sample"):
        SupportPreview(SupportConfig(), 0)
    with pytest.raises(ConfigurationError, match="3 samples.*2"):
        SupportPreview(SupportConfig(), 2).build(schedule([CORNERS] * 3, np.ones((3, 4))))
    with pytest.raises(ConfigurationError, match="margin"):
        SupportConfig(margin=-0.01)
    with pytest.raises(ConfigurationError, match="half_width"):
        SupportConfig(half_width=0.0)
