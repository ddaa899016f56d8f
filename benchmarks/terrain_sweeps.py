"""Simulated sweeps of the LIDAR over the worlds of rough ground, and the true faces of the ground there.

The robot does not move: its trunk is put at each level's pitch, with the wanted
trunk height, one scan a level or more. Points go through an attitude with errors:
one of the whole sweep, which is what an estimator has, and one of each scan.
"""

from __future__ import annotations

import math

import mujoco
import numpy as np

from bluefoot_mpc.geometry import quaternion_from_rpy
from bluefoot_mpc.navigation.crossing.config import CrossingConfig
from bluefoot_mpc.sim.config import SimConfig, WorldConfig
from bluefoot_mpc.sim.lidar import RaycastLidar
from bluefoot_mpc.sim.randomization import draw
from bluefoot_mpc.sim.world import build_world
from bluefoot_mpc.sim.worlds.make import world_plan
from bluefoot_mpc.terrain.cloud import lidar_place, scan_points
from bluefoot_mpc.terrain.sweep import levels


class Swept:
    """A world, and what sweeps of it meet."""

    def __init__(self, robot, name, seed, terrain_height=0.0):
        world = WorldConfig(name=name, terrain_height=terrain_height)
        config = SimConfig(world=world)
        self.plan, self.seed = world_plan(world, seed), seed
        self._world = build_world(robot, config, draw(config, seed), self.plan)
        self._mounts = robot.parameters.sensors
        self._height = float(robot.default_stance()[2])
        body = (self._world.model, self._world.data, self._world.trunk)
        self._lidar = RaycastLidar(*body, self._mounts, seed=seed)

    def scans(self, attitude_deg=0.2, jitter_deg=0.05, scans=1):
        """Points (k, 3) m and the LIDAR's place (3,) m as the robot believes, scan by scan."""
        rng = np.random.default_rng((self.seed, 7))
        whole = rng.normal(0.0, math.radians(attitude_deg), 2)
        position = np.array([0.0, 0.0, self._height])
        wanted = levels(CrossingConfig().sweep, self._height, self._mounts.lidar[2])
        for pitch in np.repeat(wanted[::-1], scans):
            self._put(pitch)
            error = whole + rng.normal(0.0, math.radians(jitter_deg), 2)
            believed = quaternion_from_rpy(np.array([error[0], pitch + error[1], 0.0]))
            scan = self._lidar.measure(0.0)
            yield (
                scan_points(scan, position, believed, self._mounts),
                lidar_place(position, believed, self._mounts),
            )

    def _put(self, pitch):
        data, q = self._world.data, self._world.q
        data.qpos[q : q + 7] = (
            0.0,
            0.0,
            self._height,
            math.cos(0.5 * pitch),
            0.0,
            math.sin(0.5 * pitch),
            0.0,
        )
        mujoco.mj_kinematics(self._world.model, data)


def ahead(points, reach=1.2):
    """The points that count: in front of the robot, within reach of the trunk."""
    return points[(points[:, 0] > 0.3) & (np.hypot(points[:, 0], points[:, 1]) < reach)]


def true_faces(plan, points):
    """Normals (k, 3) of the faces that points are nearest to, tops and sides, and (k,) m to the nearest edge.

    The edge is that of the outline of the nearest block seen from above; far from all blocks it is far away.
    """
    best, normal = np.abs(points[:, 2] - plan.floor), np.tile((0.0, 0.0, 1.0), (len(points), 1))
    edge = np.full(len(points), np.inf)
    for solid in plan.solids:
        axes, half = _axes(solid), 0.5 * np.array(solid.size)
        reach = float(np.linalg.norm(half)) + 0.1
        near = np.flatnonzero(np.hypot(points[:, 0] - solid.x, points[:, 1] - solid.y) < reach)
        local = (points[near] - (solid.x, solid.y, solid.z)) @ axes
        out = np.abs(local) - half
        outside = np.linalg.norm(np.maximum(out, 0.0), axis=1)
        face = out.argmax(axis=1)
        away = np.where(outside > 0.0, outside, -out.max(axis=1))
        sideways = out[:, :2]
        around = np.hypot(*np.maximum(sideways, 0.0).T)
        edge[near] = np.minimum(edge[near], np.where(around > 0.0, around, -sideways.max(axis=1)))
        nearer = away < best[near]
        chosen = near[nearer]
        best[chosen] = away[nearer]
        towards = np.sign(local[nearer, face[nearer]])
        normal[chosen] = axes.T[face[nearer]] * towards[:, None]
    return normal, edge


def faces_below(plan, points):
    """Normals (k, 3) of the upper sides that lie under or over points: what a foot would meet there."""
    top, normal = np.full(len(points), plan.floor), np.tile((0.0, 0.0, 1.0), (len(points), 1))
    for solid in plan.solids:
        axes, half = _axes(solid), 0.5 * np.array(solid.size)
        # Along the vertical to the plane of the upper side.
        up = axes[:, 2]
        level = solid.z + half[2] / up[2] - ((points[:, :2] - (solid.x, solid.y)) @ up[:2]) / up[2]
        there = np.column_stack((points[:, :2], level)) - (solid.x, solid.y, solid.z)
        on = (np.abs(there @ axes)[:, :2] <= half[:2]).all(axis=1) & (level > top)
        top[on], normal[on] = level[on], up
    return normal


def _axes(solid):
    """(3, 3) axes of a solid in its columns: pitched, then turned."""
    cy, sy, cp, sp = math.cos(solid.yaw), math.sin(solid.yaw), math.cos(solid.pitch), math.sin(solid.pitch)
    return np.array([[cy * cp, -sy, cy * sp], [sy * cp, cy, sy * sp], [-sp, 0.0, cp]])


def angles(found, true):
    """(k,) degrees between unit normals."""
    return np.degrees(np.arccos(np.clip((found * true).sum(axis=1), -1.0, 1.0)))
