"""Time of seeing and planning over rough ground, and errors of map and normals against the truth.

    OMP_NUM_THREADS=1 python benchmarks/terrain.py [--rounds 50] [--json]
    OMP_NUM_THREADS=1 python benchmarks/terrain.py --errors [--seeds 5] [--worlds kerb] [--set voxel=0.03]

Times: a cloud of 20,000 points to normals (voxel grid and moving least squares
included), the same cloud to a height map of 20 mm, its patches, the cost tensor
of 100 x 100 cells and 36 yaws, and the cheapest way over it. In one process and in
turns, so that all meet the same load of the machine. All of it runs in one thread, so
that the processor's time is that of one free core, whatever else the machine does.

Errors: the LIDAR of the simulation, with its noise, is swept over the ground; the
trunk's attitude is known with an error of 0.2 degrees over the sweep. The map's
error is that of its known cells within 1.2 m, at their middles.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from functools import reduce

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
from terrain_sweeps import Swept, ahead, angles, faces_below, true_faces

from bluefoot_mpc.model.robot import load_robot
from bluefoot_mpc.navigation.crossing.config import CrossingConfig
from bluefoot_mpc.settings import build, merge, parse_override
from bluefoot_mpc.sim.config import TERRAIN_WORLDS
from bluefoot_mpc.sim.worlds.heights import heights
from bluefoot_mpc.terrain.cost import CostConfig, cost_tensor
from bluefoot_mpc.terrain.frame import centres
from bluefoot_mpc.terrain.free_space import carved
from bluefoot_mpc.terrain.graph import optimal
from bluefoot_mpc.terrain.height_map import MapBuilder, Region
from bluefoot_mpc.terrain.patches import segment
from bluefoot_mpc.terrain.surface import SurfaceConfig, reconstruct
from bluefoot_mpc.terrain.voxels import thin
from bluefoot_mpc.types import HeightMap

POINTS = 20_000
BARS = {"normals": 100.0, "cost tensor": 50.0, "search": 1000.0}
"""ms of one core that the median may take."""
LIMITS = {"map_median_mm": 5.0, "map_p95_mm": 15.0, "normal_median_deg": 4.0}
CELLS, CELL, YAWS = 100, 0.02, 36
REACH = 1.2
"""m from the trunk, within which errors count."""
REGION = Region.spanning((0.30, 1.20), (-0.60, 0.60), CELL)
CROSSING = CrossingConfig()
EDGE = 0.02
"""m from an edge, within which a normal is not told apart by its face."""


def cloud_of(robot, name, seed, count):
    """(count, 3) m, points of a sweep with as many scans a level as it takes."""
    swept, points = Swept(robot, name, seed), np.zeros((0, 3))
    for scans in (1, 2, 3, 4):
        points = ahead(np.concatenate([part for part, _ in swept.scans(scans=scans)]))
        if len(points) >= count:
            break
    return np.random.default_rng(seed).permutation(points)[:count]


def large_map(seed):
    """A map of 100 x 100 cells with blocks up to 20 mm, all of it known."""
    rng = np.random.default_rng(seed)
    blocks = rng.uniform(0.0, 0.02, (CELLS // 5, CELLS // 5))
    height = np.kron(blocks, np.ones((5, 5))) + rng.normal(0.0, 0.002, (CELLS, CELLS))
    return HeightMap(
        time=0.0, cell=CELL, pose=np.zeros(4), height=height, confidence=np.ones((CELLS, CELLS))
    )  # fmt: skip


def height_map(points):
    builder = MapBuilder()
    builder.add(points, 0.0)
    return builder.build(REGION)


def timings(robot, rounds):
    """Times (ms, wall and processor) of each part, in turns."""
    cloud, ground, config = cloud_of(robot, "rubble", 0, POINTS), large_map(0), CostConfig(yaws=YAWS)
    cost = cost_tensor(ground, config)
    standing = np.flatnonzero(np.isfinite(cost[CELLS // 2, :, YAWS // 2]))
    start = (CELLS // 2, int(standing[0]), YAWS // 2)
    trimmed = np.ascontiguousarray(cost[:, : int(standing[-1]) + 1])
    parts = {
        "normals": lambda: reconstruct(cloud),
        "height map": lambda: height_map(cloud),
        "patches": lambda: segment(ground),
        "cost tensor": lambda: cost_tensor(ground, config),
        "search": lambda: optimal(trimmed, start),
    }
    wall, processor = {name: [] for name in parts}, {name: [] for name in parts}
    for turn in range(rounds + 1):
        for name, call in parts.items():
            begin, began = time.perf_counter(), time.process_time()
            call()
            if turn:  # the first round makes everything warm
                wall[name].append(1e3 * (time.perf_counter() - begin))
                processor[name].append(1e3 * (time.process_time() - began))
    print_times(wall, processor, len(cloud), rounds)
    return {name: {"wall": quantiles(wall[name]), "processor": quantiles(processor[name])} for name in parts}


def quantiles(values):
    p50, p99 = np.percentile(values, [50, 99])
    return {"p50": round(float(p50), 2), "p99": round(float(p99), 2)}


def print_times(wall, processor, points, rounds):
    print(f"{points} points, load average {os.getloadavg()[0]:.1f}, {rounds} rounds; ms")
    print(f"{'part':14s}{'wall p50':>9s}{'p99':>9s}{'CPU p50':>9s}{'p99':>9s}{'bar':>8s}")
    for name, values in wall.items():
        p50, p99 = np.percentile(processor[name], [50, 99])
        bar = BARS.get(name)
        word = "" if bar is None else f"{bar:8.0f}  {'holds' if p50 <= bar else 'DOES NOT HOLD'}"
        print(f"{name:14s}{np.median(values):9.1f}{np.percentile(values, 99):9.1f}{p50:9.1f}{p99:9.1f}{word}")


def errors_of(swept, config):
    """Errors of the map (m) and of normals (degrees) of one sweep, as the robot sweeps and maps."""
    builder, parts, origins = MapBuilder(CROSSING.map), [], []
    for k, (points, origin) in enumerate(swept.scans(scans=CROSSING.sweep.dwell_scans)):
        builder.add(points, 0.1 * k, origin)
        parts.append(points)
        origins.append(np.broadcast_to(origin, points.shape))
    cloud = np.concatenate(parts)
    ground = carved(builder.build(REGION), cloud, np.concatenate(origins), CROSSING.free_space)
    places = centres(ground)
    within = np.hypot(places[..., 0], places[..., 1]) <= REACH
    known = np.isfinite(ground.height) & within
    cloud = ahead(cloud, REACH)
    surface = reconstruct(cloud, config)
    true, edge = true_faces(swept.plan, surface.points)
    return {
        "map": np.abs(ground.height[known] + ground.pose[2] - heights(swept.plan, places[known])),
        "known": known.sum() / within.sum(),
        "face": angles(surface.normals, true),
        "below": angles(surface.normals, faces_below(swept.plan, surface.points)),
        "edge": edge,
        "kept": len(surface.points) / len(thin(cloud, config.voxel).points),
    }


def errors(robot, worlds, seeds, height, config):
    """Errors over seeds, world by world."""
    scans = CROSSING.sweep.dwell_scans
    print(f"{seeds} seeds a world; one sweep each, scans a level: {scans}, cells of {1e3 * CELL:.0f} mm")
    print("map: |error| of known cells, mm; normals: degrees from the nearest face, sides included (all;")
    print(f"farther than {1e3 * EDGE:.0f} mm from edges), and from the upper side at their place;")
    print("kept: share of voxels that are surface\n")
    print(f"{'world':14s}{'map p50':>8s}{'p95':>7s}{'known':>7s}{'all p50':>9s}{'p90':>7s}{'off edges':>10s}"
          f"{'share':>7s}{'upper':>7s}{'p90':>7s}{'kept':>7s}  limits")  # fmt: skip
    report = {}
    for name in worlds:
        runs = [errors_of(Swept(robot, name, seed, height), config) for seed in range(seeds)]
        report[name] = row = summed(runs)
        holds = all(row[key] <= limit for key, limit in LIMITS.items())
        print(
            f"{name:14s}{row['map_median_mm']:8.1f}{row['map_p95_mm']:7.1f}{row['known']:7.0%}"
            f"{row['normal_median_deg']:9.2f}{row['normal_p90_deg']:7.1f}{row['off_edges_median_deg']:10.2f}"
            f"{row['off_edges_share']:7.0%}{row['upper_median_deg']:7.2f}{row['upper_p90_deg']:7.1f}{row['kept']:7.0%}"
            f"  {'hold' if holds else 'DO NOT HOLD'}; worst seed's normals {row['worst_seed_deg']:.2f}",
            flush=True,
        )
    return report


def summed(runs):
    """Figures of all runs together, and of the worst one."""
    off, face, below, edge = (
        np.concatenate([run[key] for run in runs]) for key in ("map", "face", "below", "edge")
    )
    far = edge > EDGE
    figures = {
        "map_median_mm": 1e3 * np.median(off),
        "map_p95_mm": 1e3 * np.percentile(off, 95.0),
        "known": np.mean([run["known"] for run in runs]),
        "normal_median_deg": np.median(face),
        "normal_p90_deg": np.percentile(face, 90.0),
        "off_edges_median_deg": np.median(face[far]),
        "off_edges_share": far.mean(),
        "upper_median_deg": np.median(below),
        "upper_p90_deg": np.percentile(below, 90.0),
        "kept": np.mean([run["kept"] for run in runs]),
        "worst_seed_deg": max(np.median(run["face"]) for run in runs),
    }
    return {key: round(float(value), 3) for key, value in figures.items()}


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rounds", type=int, default=50)
    parser.add_argument("--errors", action="store_true", help="against the truth, instead of times")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--worlds", nargs="*", default=["rubble"], choices=TERRAIN_WORLDS)
    parser.add_argument("--height", type=float, default=0.0, help="m, of the ground; 0: the world's own")
    parser.add_argument(
        "--set", nargs="*", default=[], metavar="KEY=VALUE", help="of the surface, for example fit.step=0.006"
    )
    parser.add_argument("--json", action="store_true", help="print all figures as JSON too")
    given = parser.parse_args()
    robot = load_robot()
    if given.errors:
        changes = reduce(merge, map(parse_override, given.set), {})
        config = build(SurfaceConfig, changes, "surface")
        report = errors(robot, given.worlds, given.seeds, given.height, config)
    else:
        report = timings(robot, given.rounds)
    if given.json:
        print(json.dumps(report))


if __name__ == "__main__":
    main()
