"""Height maps from clouds, against the true ground."""

from __future__ import annotations

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.terrain.cells import CellConfig, cell_heights
from bluefoot_mpc.terrain.frame import bilinear, centres, heights_at
from bluefoot_mpc.terrain.height_map import (
    MapBuilder,
    MapConfig,
    ReachConfig,
    Region,
    choose_region,
    gradients,
    known_share,
)
from bluefoot_mpc.types import FloatArray, HeightMap
from tests.terrain.boxes import Box, Off, heights, rubble, sweep

CELL = 0.02
AHEAD = Region.spanning((0.0, 1.3), (-0.7, 0.7), CELL)


def _map(
    boxes: list[Box], seed: int = 0, config: MapConfig | None = None, off: Off | None = None
) -> HeightMap:
    builder = MapBuilder(config)
    for points, time, origin in sweep(boxes, np.random.default_rng(seed), off=off):
        builder.add(points, time, origin)
    return builder.build(AHEAD)


def _errors(ground: HeightMap, boxes: list[Box]) -> tuple[FloatArray, FloatArray]:
    """Errors (m) of known cells within 1.2 m: by the height at the centre, and by the highest in the cell."""
    places = centres(ground)
    fine = (np.arange(5) + 0.5) / 5 * CELL - 0.5 * CELL
    highest = np.max([heights(boxes, places + np.array((a, b))) for a in fine for b in fine], axis=0)
    seen = np.isfinite(ground.height) & (np.hypot(places[..., 0], places[..., 1]) <= 1.2)
    assert seen.sum() > 1000
    return (ground.height - heights(boxes, places))[seen], (ground.height - highest)[seen]


def test_map_errors_within_the_bounds() -> None:
    """With the LIDAR's noise: median 5 mm and 95 % within 15 mm, by either definition of a cell's height."""
    boxes = rubble(3, 0.020)
    for error in _errors(_map(boxes, off=Off(jitter_deg=0.15)), boxes):
        assert np.median(np.abs(error)) <= 0.003
        assert np.quantile(np.abs(error), 0.95) <= 0.015
    _, error = _errors(_map(rubble(4, 0.030), off=Off(tilt_deg=0.2, jitter_deg=0.15)), rubble(4, 0.030))
    assert np.median(np.abs(error)) <= 0.005
    assert np.quantile(np.abs(error), 0.95) <= 0.015


def test_the_plain_maximum_lies_too_high() -> None:
    """Of twelve points on even ground it is 1.6 standard deviations; the corrected one is not."""
    height = np.random.default_rng(0).normal(0.0, 0.003, 12 * 400)
    index, noise = np.repeat(np.arange(400), 12), np.full(len(height), 0.003)
    printed, upper, mean = (
        cell_heights(index, height, noise, 400, CellConfig(estimate=estimate))[0]
        for estimate in ("maximum", "upper", "mean")
    )
    assert np.mean(printed) == pytest.approx(1.63 * 0.003, rel=0.05)
    assert abs(np.mean(upper)) < 0.0003
    assert np.std(upper) < 1.5 * np.std(mean)


def test_what_no_ray_met_is_unknown() -> None:
    """The shadow behind a block, the ground at the robot's feet, and what lies beyond the sweep."""
    ground = _map([Box(0.8, 0.0, 0.1, 0.3, 0.06)])
    for place in ([0.92, 0.0], [0.2, 0.0], [1.0, 0.65]):
        known = np.isfinite(heights_at(ground, np.array(place)))
        assert known == (place[1] > 0.5)
    assert heights_at(ground, np.array([0.8, 0.0])) == pytest.approx(0.06, abs=0.003)
    unknown = np.isnan(ground.height)
    assert (ground.confidence[unknown] == 0.0).all()
    assert (ground.confidence[~unknown] > 0.0).all()
    assert ground.confidence.max() <= 1.0


def test_confidence_is_less_at_edges_and_with_few_points() -> None:
    """A cell that an edge crosses is trusted less than the ground around it."""
    ground = _map([Box(0.81, 0.0, 0.2, 0.4, 0.03)])
    places = centres(ground)
    edge = (np.abs(places[..., 0] - 0.71) < 0.011) & (np.abs(places[..., 1]) < 0.15)
    floor = (np.abs(places[..., 0] - 0.60) < 0.03) & (np.abs(places[..., 1]) < 0.15)
    assert np.median(ground.confidence[edge]) < 0.7 * np.median(ground.confidence[floor])
    index, height, noise = np.zeros(40, dtype=np.intp), np.zeros(40), np.full(40, 0.003)
    few, many = (cell_heights(index[:k], height[:k], noise[:k], 1, CellConfig())[1][0] for k in (2, 40))
    assert few < many


def test_false_echoes_in_a_cell_do_not_decide_it() -> None:
    """One of twenty points far above the rest, which the plain maximum would take."""
    height = np.random.default_rng(0).normal(0.0, 0.002, 20)
    height[7] = 0.08
    index, noise = np.zeros(20, dtype=np.intp), np.full(20, 0.002)
    assert abs(cell_heights(index, height, noise, 1, CellConfig())[0][0]) < 0.002
    assert cell_heights(index, height, noise, 1, CellConfig(estimate="maximum"))[0][0] == 0.08


@pytest.mark.parametrize("points", [np.zeros((0, 3)), np.full((50, 3), np.nan), np.array([[0.6, 0.0, 0.0]])])
def test_nothing_to_see_is_an_unknown_map(points: FloatArray) -> None:
    """An empty cloud, one of NaN, and a single point, which is not enough for a cell."""
    builder = MapBuilder()
    builder.add(points, 1.0, np.array([0.0, 0.0, 0.2]))
    ground = builder.build(AHEAD)
    assert known_share(ground) == 0.0
    assert ground.height.shape == (AHEAD.n, AHEAD.m)
    assert np.isnan(gradients(ground)[0]).all()
    assert choose_region(points, np.zeros(3)).n == 40


def test_a_region_off_the_data_is_unknown() -> None:
    """Nothing is carried over from elsewhere."""
    builder = MapBuilder()
    builder.add(np.random.default_rng(0).uniform(0.0, 1.0, (500, 3)), 1.0)
    assert known_share(builder.build(Region.spanning((5.0, 6.0), (0.0, 1.0), CELL))) == 0.0
    with pytest.raises(ConfigurationError, match="finite"):
        Region(pose=np.array([0.0, np.nan, 0.0, 0.0]), n=3, m=3)
    with pytest.raises(ConfigurationError, match="must have 1 to"):
        Region.spanning((0.0, 1000.0), (0.0, 1000.0), CELL)


def test_regions_share_one_grid() -> None:
    """Corners lie on whole cells, also where the numbers hardly do."""
    region = Region.spanning((-0.01, 0.6), (0.1, 0.3), CELL)
    assert region.pose.tolist() == pytest.approx([-0.02, 0.1, 0.0, 0.0])
    assert (region.n, region.m) == (10, 31)


def test_a_turned_region_shows_the_same_ground() -> None:
    """Its cells' centres, taken to the odometry frame, have the heights of what stands there."""
    rng = np.random.default_rng(0)
    points = rng.uniform((0.0, -1.0, 0.0), (1.0, 1.0, 0.0), (60_000, 3))
    points[:, 2] = 0.2 * points[:, 0] - 0.1 * points[:, 1] + 0.5
    builder = MapBuilder(MapConfig(cells=CellConfig(estimate="mean")))
    builder.add(points, 1.0)
    ground = builder.build(Region(pose=np.array([0.3, -0.2, 0.5, 0.7]), n=15, m=20))
    places = centres(ground)
    assert ground.height == pytest.approx(0.2 * places[..., 0] - 0.1 * places[..., 1], abs=0.003)
    forward, left = gradients(ground)
    assert np.median(forward) == pytest.approx(0.2 * np.cos(0.7) - 0.1 * np.sin(0.7), abs=0.01)
    assert np.median(left) == pytest.approx(-0.2 * np.sin(0.7) - 0.1 * np.cos(0.7), abs=0.01)
    between = bilinear(ground, ground.height[..., None], places[3, 4] + (0.004, 0.003))
    assert between[0] == pytest.approx(ground.height[3, 4] + 0.2 * 0.004 - 0.1 * 0.003, abs=0.002)
    assert np.isnan(bilinear(ground, ground.height[..., None], np.array([9.0, 9.0]))).all()


def test_the_region_with_most_variation_is_chosen() -> None:
    """Blocks to one side draw the region there; a steady slope does not."""
    boxes = [Box(1.0, 0.45 + 0.1 * k, 0.05, 0.05, 0.03) for k in (-1, 0, 1)]
    points = np.vstack([scan for scan, _, _ in sweep(boxes, np.random.default_rng(0))])
    reach = ReachConfig(length=0.4, width=0.4)
    region = choose_region(points, np.zeros(3), reach)
    x, y = region.pose[:2]
    assert x < 0.97
    assert x + 0.4 > 1.03
    assert y < 0.35
    assert y + 0.4 > 0.55
    assert (region.n, region.m) == (20, 20)
    with pytest.raises(ConfigurationError, match="does not fit within reach"):
        ReachConfig(length=5.0)


def test_builder_forgets() -> None:
    """After a reset as new; beyond its capacity the oldest scans go."""
    builder = MapBuilder(MapConfig(capacity=150))
    for k in range(4):
        builder.add(np.full((60, 3), 0.5 + 0.1 * k), float(k))
    assert len(builder) == 180
    assert builder.points()[:, 0].min() == pytest.approx(0.6)
    builder.reset()
    assert len(builder) == 0
    assert known_share(builder.build(AHEAD)) == 0.0


@pytest.mark.parametrize(
    ("wrong", "cause"), [({"median": 4}, "odd"), ({"cell": 0.0}, "positive"), ({"gap": -1}, "negative")]
)
def test_configuration_is_checked(wrong: dict[str, float], cause: str) -> None:
    """A message names the value."""
    with pytest.raises(ConfigurationError, match=cause):
        MapConfig(**wrong)  # type: ignore[arg-type]


def test_points_on_one_side_of_a_cell_are_trusted_less() -> None:
    """They may have spilled over from the edge of the next one."""
    rng = np.random.default_rng(0)
    index, noise, height = np.zeros(20, dtype=np.intp), np.full(20, 0.003), rng.normal(0.0, 0.003, 20)
    even = rng.uniform(-1.0, 1.0, (20, 2))
    aside = np.column_stack((even[:, 0], 0.5 + 0.5 * even[:, 1] ** 2))
    full, less = (cell_heights(index, height, noise, 1, CellConfig(), away)[1][0] for away in (even, aside))
    assert less < 0.7 * full


def test_gaps_are_bridged_between_trusted_cells_only() -> None:
    """A cell without a point in the midst of even ground is no hole; between doubtful cells it stays one."""
    points = np.random.default_rng(0).uniform((0.4, -0.4, 0.0), (1.2, 0.4, 0.0), (20_000, 3))
    hole = (points[:, 0] > 0.8) & (points[:, 0] < 0.82) & (points[:, 1] > 0.0) & (points[:, 1] < 0.02)
    for trust, known in ((0.5, True), (1.0, False)):
        builder = MapBuilder(MapConfig(gap_trust=trust))
        builder.add(points[~hole], 1.0)
        ground = builder.build(AHEAD)
        assert np.isfinite(heights_at(ground, np.array([0.81, 0.01]))) == known
        assert ground.confidence[35, 40] == (pytest.approx(0.3, abs=0.03) if known else 0.0)


def test_many_equal_heights_are_believed() -> None:
    """The expected excess of a maximum must not take a cell below all of its points."""
    height, _ = cell_heights(
        np.zeros(3000, dtype=np.intp), np.full(3000, 0.05), np.full(3000, 0.003), 1, CellConfig(trim=0.0)
    )
    assert height[0] == pytest.approx(0.05, abs=0.015)
