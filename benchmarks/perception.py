"""Time of seeing: scans and pictures in every world, finding the marker, navigation's tick, the log's PNG.

    OMP_NUM_THREADS=1 python benchmarks/perception.py [--rounds 40] [--seconds 60] [--only maze] [--json]

All in one process. Worlds and variants take turns in short blocks, so that all of
them meet the same load of the machine. A scan is everything from MuJoCo's state to
682 distances with noise, dropouts and jitter; beside it stands a bare `mj_multiRay`
with the same rays. A picture is everything from the state to pixels; on a busy
machine its threads wait for processors, so its processor time is told besides. A navigation
tick is `Navigator.step`, on sweeps of the simulated LIDAR, while a robot without
legs drives through the world as the navigator wants.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import time
from dataclasses import replace

import mujoco
import numpy as np

from bluefoot_mpc.control.config import ControlConfig
from bluefoot_mpc.io.lidar.geometry import GREATEST_RANGE, POINTS, bearings
from bluefoot_mpc.model.robot import load_robot
from bluefoot_mpc.navigation.marker import MarkerConfig, MarkerFinder
from bluefoot_mpc.navigation.navigator import Navigator
from bluefoot_mpc.runtime.packed_pictures import pack
from bluefoot_mpc.sim.camera import RenderedCamera
from bluefoot_mpc.sim.config import PLANNED_WORLDS, SimConfig, WorldConfig
from bluefoot_mpc.sim.graphics import chosen_library
from bluefoot_mpc.sim.leader_config import LeaderConfig
from bluefoot_mpc.sim.lidar import RaycastLidar
from bluefoot_mpc.sim.randomization import draw
from bluefoot_mpc.sim.robot import SimRobot
from bluefoot_mpc.sim.sight_config import CameraConfig
from bluefoot_mpc.sim.terrain import WORLD_GROUPS
from bluefoot_mpc.sim.world import build_world
from bluefoot_mpc.sim.worlds.make import world_plan
from bluefoot_mpc.types import BodyState, Guide, GuideTask

BARS = {"scan": 500.0, "picture": 40_000.0, "tick": 300.0}
"""µs that the median may take."""
BLOCKS = {"bare cast": 20, "scan": 20, "picture": 4, "marker": 4, "png": 4}
"""Calls of each variant in a round."""
PLACES = 8
"""Poses from which each world is seen."""
PERIOD, SWEEP = 0.02, 5
"""s of a tick, and ticks of a sweep."""


class Place:
    """A world and what looks at it."""

    def __init__(self, robot, name, seed):
        kind = name.partition(" + ")[2]
        config = SimConfig(
            world=WorldConfig(name=name.partition(" + ")[0]),
            leader=LeaderConfig(kind=kind),
            camera=CameraConfig(enabled=True),
        )
        mounts = robot.parameters.sensors
        self.name = name
        self.world = world = build_world(robot, config, draw(config, seed), world_plan(config.world, seed))
        world.data.qpos[world.q + 7 : world.q + 23] = robot.stance_joints
        self.height = float(robot.default_stance()[2])
        body = (world.model, world.data, world.trunk)
        self.lidar = RaycastLidar(*body, mounts, seed=seed)
        self.camera = RenderedCamera(*body, mounts.camera, mounts.camera_view_deg, config.camera, seed)
        self.finder = MarkerFinder(MarkerConfig(), mounts.camera_view_deg)
        self._rays = np.column_stack([np.cos(bearings()), np.sin(bearings()), np.zeros(POINTS)]).ravel()
        self._geom, self._distance = np.zeros(POINTS, dtype=np.int32), np.zeros(POINTS)
        self._mount = np.array(mounts.lidar)
        self.go(0.0, 0.0, 0.0)
        self.image = self.camera.picture(0.0)
        self.found = 0

    def go(self, x, y, yaw):
        """Put the robot somewhere, level."""
        world, half = self.world, 0.5 * yaw
        pose = (x, y, self.height, math.cos(half), 0.0, 0.0, math.sin(half))
        world.data.qpos[world.q : world.q + 7] = pose
        mujoco.mj_kinematics(world.model, world.data)

    def cast(self):
        data, trunk = self.world.data, self.world.trunk
        mujoco.mj_multiRay(
            self.world.model, data, data.xpos[trunk] + self._mount, self._rays, WORLD_GROUPS, True, trunk,
            self._geom, self._distance, None, POINTS, 0.001 * GREATEST_RANGE,
        )  # fmt: skip

    def scan(self):
        self.lidar.measure(0.0)

    def take(self):
        self.image = self.camera.picture(0.0)

    def find(self):
        self.found += self.finder.find(self.image) is not None

    def png(self):
        pack(self.image, 0.0)

    def variants(self):
        return {
            "bare cast": self.cast,
            "scan": self.scan,
            "picture": self.take,
            "marker": self.find,
            "png": self.png,
        }


def figures(microseconds):
    p50, p99 = np.percentile(microseconds, [50, 99])
    return {"p50": round(float(p50), 1), "p99": round(float(p99), 1), "calls": len(microseconds)}


def measure(places, rounds):
    """Times (µs) of every variant in every world, in turns."""
    times = {(place.name, variant): [] for place in places for variant in BLOCKS}
    processor = dict.fromkeys(times, 0.0)
    for turn in range(rounds + 1):
        for place in places:
            angle = 2.0 * math.pi * (turn % PLACES) / PLACES
            place.go(0.1 * math.cos(angle), 0.1 * math.sin(angle), angle)
            for variant, call in place.variants().items():
                began = time.process_time()
                for _ in range(BLOCKS[variant]):
                    begin = time.perf_counter()
                    call()
                    # The first round makes everything warm.
                    if turn:
                        times[place.name, variant].append(1e6 * (time.perf_counter() - begin))
                if turn:
                    processor[place.name, variant] += 1e6 * (time.process_time() - began)
    return {
        place.name: {
            variant: figures(times[place.name, variant])
            | {"processor": round(processor[place.name, variant] / len(times[place.name, variant]), 1)}
            for variant in BLOCKS
        }
        | {"marker_found": round(place.found / (BLOCKS["marker"] * (rounds + 1)), 3)}
        for place in places
    }


class Rider:
    """A navigator and a robot without legs that does what it wants."""

    def __init__(self, robot, place, frame):
        self.place, self.frame = place, frame
        self.navigator = Navigator(ControlConfig().navigation, robot.parameters.sensors)
        self.pose, self.tick = np.zeros(3), 0
        self.times = {"with a sweep": [], "between": []}

    def ride(self, ticks):
        for _ in range(ticks):
            self._step()

    def _step(self):
        now, fresh = PERIOD * self.tick, self.tick % SWEEP == 0
        scan = None
        if fresh:
            self.place.go(*self.pose)
            scan = self.place.lidar.measure(now)
        frame, state = replace(self.frame, time=now, lidar=scan), self._state(now)
        guide = Guide(task=GuideTask.WANDER)
        begin = time.perf_counter()
        decision = self.navigator.step(guide, frame, state, PERIOD)
        self.times["with a sweep" if fresh else "between"].append(1e6 * (time.perf_counter() - begin))
        forward, left = decision.velocity
        cosine, sine = math.cos(self.pose[2]), math.sin(self.pose[2])
        self.pose += PERIOD * np.array(
            [cosine * forward - sine * left, sine * forward + cosine * left, decision.yaw_rate]
        )
        self.tick += 1

    def _state(self, now):
        x, y, yaw = self.pose
        return BodyState(
            time=now, position=np.array([x, y, self.place.height]),
            quaternion=np.array([0.0, 0.0, math.sin(0.5 * yaw), math.cos(0.5 * yaw)]),
            rpy=np.array([0.0, 0.0, yaw]), linear_velocity=np.zeros(3), angular_velocity=np.zeros(3),
            joint_position=np.zeros(16), joint_velocity=np.zeros(16), contact=np.ones(4, dtype=np.bool_),
            foot_position_in_base=np.zeros((4, 3)), height=self.place.height,
        )  # fmt: skip


def navigate(robot, places, seconds):
    """Times (µs) of navigation's ticks, worlds in turns of a second."""
    frame = SimRobot(robot, SimConfig(settle_time=0.02)).reset()
    riders = [Rider(robot, place, frame) for place in places]
    for _ in range(round(seconds)):
        for rider in riders:
            rider.ride(round(1.0 / PERIOD))
    return {
        rider.place.name: {
            **{kind: figures(times) for kind, times in rider.times.items()},
            "all": figures(rider.times["with a sweep"] + rider.times["between"]),
            "driven_m": round(float(np.hypot(*rider.pose[:2])), 2),
        }
        for rider in riders
    }


def verdicts(seeing, ticks):
    """Which bars hold, in the slowest world."""
    slowest = {
        "scan": max(row["scan"]["p50"] for row in seeing.values()),
        "picture": max(row["picture"]["p50"] for row in seeing.values()),
        "tick": max(row["with a sweep"]["p50"] for row in ticks.values()),
    }
    return {
        name: {"slowest_p50_us": slowest[name], "bar_us": bar, "holds": slowest[name] <= bar}
        for name, bar in BARS.items()
    }


def show(report):
    print(f"load average {report['load']}, pictures drawn by {report['graphics']}; µs, median (99 %)")
    print(
        f"{'world':22s}" + "".join(f"{variant:>20s}" for variant in BLOCKS) + "  picture's CPU  marker found"
    )
    for name, row in report["seeing"].items():
        cells = "".join(f"{row[v]['p50']:10.0f} ({row[v]['p99']:7.0f})" for v in BLOCKS)
        print(f"{name:22s}{cells}{row['picture']['processor']:15.0f}{row['marker_found']:14.0%}")
    print("\nnavigation tick, µs, median (99 %)")
    for name, row in report["ticks"].items():
        kinds = ("with a sweep", "between", "all")
        print(f"{name:22s}" + "".join(f"  {k}: {row[k]['p50']:.0f} ({row[k]['p99']:.0f})" for k in kinds))
    print()
    for name, bar in report["bars"].items():
        word = "holds" if bar["holds"] else "DOES NOT HOLD"
        slowest = bar["slowest_p50_us"]
        print(f"{name}: median of the slowest world {slowest:.0f} µs, bar {bar['bar_us']:.0f}: {word}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=40)
    parser.add_argument("--seconds", type=float, default=60.0, help="of driving in each world")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--only", nargs="*", default=[*PLANNED_WORLDS, "arena + differential", "arena + mecanum"]
    )
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    robot = load_robot()
    places = [Place(robot, name, options.seed) for name in options.only]
    seeing = measure(places, options.rounds)
    ticks = navigate(robot, [place for place in places if "+" not in place.name], options.seconds)
    report = {
        "load": [round(value, 1) for value in os.getloadavg()],
        "graphics": chosen_library(), "seeing": seeing, "ticks": ticks, "bars": verdicts(seeing, ticks),
    }  # fmt: skip
    print(json.dumps(report)) if options.json else show(report)


if __name__ == "__main__":
    main()
