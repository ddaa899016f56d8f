"""What is known of the ground ahead, and how it is crossed."""

from __future__ import annotations

import enum
from dataclasses import dataclass, field

import numpy as np

from bluefoot_mpc.types.common import FloatArray


@dataclass(frozen=True, kw_only=True, slots=True)
class HeightMap:
    """A 2.5-D map of the ground: one height a cell, in a frame of its own.

    The map's frame stands in the odometry frame: its origin is the outer corner of cell (0, 0), x runs
    forward along index j, y to the left along index i, z up. Cell (i, j) is centred at
    ``((j + 0.5) cell, (i + 0.5) cell)``.

    Attributes:
        time: s, of the newest point in it.
        cell: m, side of a cell.
        pose: (4,) x, y, z (m) and yaw (rad) of the map's frame in the odometry frame.
        height: (n, m) m above the map's origin; NaN where the ground is unknown.
        confidence: (n, m) 0..1, how far a height is to be trusted; 0 where it is unknown.
    """

    time: float
    cell: float
    pose: FloatArray
    height: FloatArray
    confidence: FloatArray


class CrossingPhase(enum.StrEnum):
    """What a robot that crosses rough ground is at."""

    SWEEP = "sweep"
    THINK = "think"
    WALK = "walk"
    ARRIVED = "arrived"
    BLOCKED = "blocked"


@dataclass(frozen=True, kw_only=True, slots=True)
class CrossingReport:
    """What was seen of the ground on one tick, and what was decided.

    Attributes:
        phase: what the robot is at.
        level: index of the sweep's level; -1 outside a sweep.
        pitch: rad, wanted pitch of the trunk, nose down positive.
        points: (n, 3) m, what the scan of this tick met, odometry frame; empty without a new scan.
        ground: the map, on ticks on which it is new; else None.
        route: (k, 3) x, y (m) and yaw (rad) of the way planned for the trunk, odometry frame, on ticks on
            which it is new; else empty.
        footholds: (4, 3) m, where the feet are to land next, odometry frame; NaN where nothing was chosen.
        lift: (4,) m, step heights of the next swings; NaN where nothing was chosen.
        speed: m/s, allowed by the difficulty of the ground.
        sweeps: sweeps ended so far.
        drift: m, correction of the older map by the newest sweep.
        reason: why, in few words, where that is not plain.
    """

    phase: CrossingPhase
    level: int = -1
    pitch: float = 0.0
    points: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))
    ground: HeightMap | None = None
    route: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))
    footholds: FloatArray = field(default_factory=lambda: np.full((4, 3), np.nan))
    lift: FloatArray = field(default_factory=lambda: np.full(4, np.nan))
    speed: float = 0.0
    sweeps: int = 0
    drift: float = 0.0
    reason: str = ""
