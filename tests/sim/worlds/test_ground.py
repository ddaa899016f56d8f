"""Rough ground from seeds: level at the start, as high as asked for, never the same twice."""

import functools
import math
from dataclasses import replace

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.sim.config import (
    PLANNED_WORLDS,
    TERRAIN_HEIGHTS,
    TERRAIN_WORLDS,
    WORLDS,
    SimConfig,
    WorldConfig,
)
from bluefoot_mpc.sim.leader_config import LeaderConfig
from bluefoot_mpc.sim.worlds import footprint
from bluefoot_mpc.sim.worlds.coverage import reachable
from bluefoot_mpc.sim.worlds.files import read_plan, write_plan
from bluefoot_mpc.sim.worlds.ground import DEPTH, TERRAINS
from bluefoot_mpc.sim.worlds.heights import heights
from bluefoot_mpc.sim.worlds.make import world_plan
from bluefoot_mpc.sim.worlds.plan import Solid, WorldPlan

SEEDS = range(4)
CELL = 0.01


@functools.cache
def plan_of(kind, seed, **changes):
    return world_plan(WorldConfig(name=kind, **changes), seed)


def field(plan, x=(-0.5, 2.9), y=(-0.9, 0.9), rows=0.04):
    """Heights, columns along x every centimetre, rows along y, off the edges of cells."""
    axes = np.arange(*x, CELL) + 0.37 * CELL, np.arange(*y, rows) + 0.41 * CELL
    return heights(plan, np.stack(np.meshgrid(*axes), axis=-1))


each_kind = pytest.mark.parametrize("kind", TERRAIN_WORLDS)


def test_every_kind_has_a_maker_and_a_name_of_its_own():
    assert set(TERRAINS) == set(TERRAIN_WORLDS) < set(WORLDS)
    assert not set(TERRAIN_WORLDS) & set(PLANNED_WORLDS)
    assert set(TERRAIN_HEIGHTS) == set(TERRAIN_WORLDS) - {"gap"}


@each_kind
def test_every_seed_gives_other_ground_and_the_same_one_twice(kind):
    fields = [field(plan_of(kind, seed), (0.4, 2.2)) for seed in SEEDS]
    assert plan_of(kind, 3) == world_plan(WorldConfig(name=kind), 3)
    assert plan_of(kind, 3) == world_plan(WorldConfig(name=kind, layout_seed=3), 8)
    for k, one in enumerate(fields):
        for other in fields[:k]:
            assert np.mean(np.abs(one - other) > 1e-4) > 0.004


@each_kind
def test_the_start_is_level_and_the_ground_is_rough_as_far_as_the_goal(kind):
    for seed in SEEDS:
        plan = plan_of(kind, seed)
        height = field(plan)
        start = int(0.92 / CELL)
        assert height[:, :start].max() == 0.0
        # What is lower than the start begins where the robot's feet are not.
        assert field(plan, (-0.5, 0.41), (-0.45, 0.45)).min() == 0.0
        assert not plan.is_even
        assert not footprint.in_the_way(plan.solids)
        if kind in {"rubble", "random_steps"}:
            strips = np.abs(height[:, int(1.0 / CELL) : int(2.65 / CELL)]).reshape(height.shape[0], -1, 11)
            assert (strips.max(axis=(0, 2)) > 0.005).all()


@pytest.mark.parametrize("greatest", [0.0, 0.03])
@pytest.mark.parametrize("kind", TERRAIN_HEIGHTS)
def test_ground_is_as_high_as_asked_for(kind, greatest):
    height = field(plan_of(kind, 1, terrain_height=greatest), (0.42, 2.2))
    wanted = greatest or TERRAIN_HEIGHTS[kind]
    top = height.max() + (0.5 * wanted if kind == "stones" else 0.0)
    assert 0.93 * wanted < top <= wanted + 1e-9


def test_blocks_of_rubble_cover_half_of_the_ground_and_more_and_keep_off_each_other():
    for seed in SEEDS:
        plan = plan_of("rubble", seed)
        sides = np.array([solid.size[:2] for solid in plan.solids])
        assert sides.min() >= 0.04
        assert sides.max() <= 0.15
        cover = np.mean(field(plan, (0.42, 2.2), (-1.0, 1.0), 0.01) > 0.0)
        assert 0.53 < cover < 0.58
        # No ground is counted twice: what they cover is the sum of their areas.
        assert cover * 1.78 * 2.0 == pytest.approx(np.prod(sides, axis=1).sum(), rel=0.02)
        yaw = np.array([solid.yaw for solid in plan.solids])
        assert np.histogram(yaw, 4, (-0.5 * math.pi, 0.5 * math.pi))[0].min() > 0.15 * len(yaw)


def test_neighbouring_plates_differ():
    height = np.array([0.5 * s.size[2] for s in plan_of("random_steps", 2).solids])
    y = np.array([solid.y for solid in plan_of("random_steps", 2).solids])
    same_row = np.diff(y) > 0.0
    assert np.abs(np.diff(2.0 * height))[same_row].min() > 0.2 * 0.020


def test_a_kerb_crosses_the_whole_way_once():
    for seed in SEEDS:
        up = field(plan_of("kerb", seed)) > 0.01
        assert (np.diff(up.astype(int), axis=1) >= 0).all()
        edge = up.argmax(axis=1) * CELL - 0.5
        assert 0.54 < edge[len(edge) // 2] < 0.82
        assert edge.min() > 0.41


@pytest.mark.parametrize("width", [0.06, 0.10])
def test_a_gap_is_as_wide_as_asked_for(width):
    for seed in SEEDS:
        plan = plan_of("gap", seed, gap=width)
        deep = field(plan) < -0.01
        yaw = plan.solids[0].yaw
        across = deep.sum(axis=1) * CELL * math.cos(yaw)
        assert across == pytest.approx(width, abs=1.1 * CELL)
        assert field(plan).min() == -DEPTH


def test_a_ramp_climbs_and_falls_as_steeply_as_asked_for():
    plan = plan_of("ramp", 2, ramp_deg=12.0)
    line = np.stack([np.linspace(0.3, 2.0, 500), np.zeros(500)], axis=1)
    slope = np.gradient(heights(plan, line), line[:, 0])
    wanted = math.tan(math.radians(12.0)) * math.cos(plan.solids[0].yaw)
    assert np.median(slope[slope > 0.1]) == pytest.approx(wanted, rel=1e-6)
    assert np.median(slope[slope < -0.1]) == pytest.approx(-wanted, rel=1e-6)
    assert np.abs(slope).max() < 1.01 * wanted
    assert heights(plan, line)[-1] == 0.0


def test_stones_are_as_large_and_as_far_apart_as_asked_for():
    gaps = []
    for seed in SEEDS:
        plan = plan_of("stones", seed)
        stones = [solid for solid in plan.solids if solid.name.startswith("stone")]
        assert {stone.size[:2] for stone in stones} == {(0.12, 0.12)}
        rows = sorted({stone.x for stone in stones})
        gaps += [*(np.diff(rows) - 0.12), rows[0] - 0.06 - 0.42]
        y = np.array([stone.y for stone in stones if stone.x == rows[2]])
        gaps += [*(np.diff(y) - 0.12)]
        assert y.max() > 0.7
        assert y.min() < -0.7
        # The platform begins a gap behind the last row, which lies before the goal's far side.
        end = plan.solids[-1].x - 0.5 * plan.solids[-1].size[0]
        assert end - rows[-1] - 0.06 == pytest.approx(0.06, abs=0.016)
        assert 1.6 < end < 1.9
    assert np.mean(gaps) == pytest.approx(0.06, abs=0.002)
    assert min(gaps) > 0.044
    assert max(gaps) < 0.076


@each_kind
def test_a_file_gives_the_same_ground_again(kind, tmp_path):
    write_plan(plan_of(kind, 4), tmp_path / "own.toml")
    assert read_plan(tmp_path / "own.toml") == plan_of(kind, 4)
    config = WorldConfig(name=str(tmp_path / "own.toml"))
    assert world_plan(config, 0) == plan_of(kind, 4)


def test_ground_does_not_stand_in_the_way():
    assert reachable(plan_of("rubble", 0)).area > 6.0


@pytest.mark.parametrize(
    ("table", "cause"),
    [
        ({"name": "rubble", "terrain_height": -0.01}, r"terrain_height = -0\.01 must lie in 0\.\.0\.1"),
        ({"name": "rubble", "terrain_height": math.nan}, "terrain_height = nan must lie in"),
        ({"name": "rubble", "terrain_height": 0.2}, "terrain_height = 0.2 must lie in"),
        ({"name": "stones", "terrain_height": 0.08}, r"must lie in 0\.\.0\.05"),
        ({"name": "stones", "stone": 0.0}, "stone = 0.0 must lie in"),
        ({"name": "gap", "gap": 0.5}, r"gap = 0\.5 must lie in 0\.01\.\.0\.3"),
        ({"name": "gap", "gap": 0.0}, "gap = 0.0 must lie in"),
        ({"name": "ramp", "ramp_deg": 60.0}, r"ramp_deg = 60\.0 must lie in"),
        ({"name": "kerb", "slope_deg": 5.0}, "leave slope_deg = 5 out"),
    ],
)
def test_impossible_ground_is_refused(table, cause):
    with pytest.raises(ConfigurationError, match=cause):
        WorldConfig(**table)


@pytest.mark.parametrize(
    ("table", "way_out"),
    [
        ({"name": "flat", "terrain_height": 0.02}, "'flat': leave it out, or take one of: rubble, .*stones"),
        ({"name": "gap", "terrain_height": 0.02}, "take one of: rubble"),
        ({"name": "rubble", "gap": 0.05}, "take one of: gap, stones"),
        ({"name": "kerb", "stone": 0.05}, "take one of: stones"),
        ({"name": "maze", "ramp_deg": 5.0}, "take one of: ramp"),
    ],
)
def test_figures_without_effect_are_refused(table, way_out):
    config = WorldConfig(**table)
    with pytest.raises(ConfigurationError, match=way_out):
        world_plan(config, 0)


def test_a_leader_needs_level_floor():
    with pytest.raises(ConfigurationError, match="world 'kerb' is none"):
        SimConfig(world=WorldConfig(name="kerb"), leader=LeaderConfig(kind="differential"))


def slab(**changes):
    values = {"name": "slab", "shape": "box", "x": 1.0, "y": 0.0, "z": -0.04, "size": (0.5, 1.0, 0.08)}
    return Solid(**{**values, "is_ground": True, **changes})


def test_ground_may_end_below_zero_but_not_below_the_floor():
    plan = WorldPlan(name="own", seed=0, bounds=(-1.0, -1.0, 2.0, 1.0), solids=(slab(),), floor=-0.08)
    assert heights(plan, np.array([[1.0, 0.0], [0.0, 0.0]])) == pytest.approx([0.0, -0.08])
    with pytest.raises(ConfigurationError, match="'slab': it is below the floor"):
        replace(plan, floor=0.0)
    with pytest.raises(ConfigurationError, match="floor = 0.1 must lie in"):
        replace(plan, floor=0.1)
    with pytest.raises(ConfigurationError, match="only boxes of the ground are tilted"):
        slab(pitch=0.2, is_ground=False)


@pytest.mark.parametrize(
    ("old", "new", "cause"),
    [
        ("floor = -0.08", "floor = -0.05", "the ground under the start is not even"),
        ("x = 1.0", "x = 0.3", "the ground under the start is not even"),
    ],
)
def test_a_file_without_even_ground_to_start_on_is_refused(tmp_path, old, new, cause):
    file = tmp_path / "own.toml"
    start = slab(name="start", x=-0.2, size=(1.2, 2.0, 0.08))
    step = slab(z=0.01, size=(0.5, 1.0, 0.02))
    bounds = (-1.0, -1.0, 2.0, 1.0)
    write_plan(WorldPlan(name="own", seed=0, bounds=bounds, solids=(start, step), floor=-0.08), file)
    assert read_plan(file).floor == -0.08
    text = file.read_text()
    assert old in text
    if old.startswith("floor"):
        # Without its platform the robot would start on the floor, below zero.
        text = text.replace("x = -0.2", "x = 1.9")
    file.write_text(text.replace(old, new))
    with pytest.raises(ConfigurationError, match=cause):
        read_plan(file)


def test_what_has_no_height_in_a_file_stands_on_the_floor(tmp_path):
    file = tmp_path / "own.toml"
    start = slab(name="start", x=-0.2, size=(1.2, 2.0, 0.08))
    write_plan(
        WorldPlan(name="own", seed=0, bounds=(-1.0, -1.0, 2.0, 1.0), solids=(start,), floor=-0.08), file
    )
    text = file.read_text()
    assert "z = -0.04\n" in text
    file.write_text(text.replace("z = -0.04\n", ""))
    assert read_plan(file).solids[0].z == -0.04
