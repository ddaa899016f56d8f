"""Clouds as a LIDAR 0.24 m above the ground makes them, without a simulator."""

import numpy as np

SENSOR = np.array([0.0, 0.0, 0.24])


def seen(points, rng, sigma=0.01):
    """Points (n, 3) m with the error of a range (m) along the rays."""
    ray = points - SENSOR
    ray /= np.linalg.norm(ray, axis=1)[:, None]
    return points + ray * rng.normal(0.0, sigma, (len(points), 1))


def ground(rng, count, slope_deg=0.0):
    """Points (n, 3) m on a plane that rises ahead from x = 0.3 m, and its normal (3,)."""
    x, y = rng.uniform(0.3, 1.2, count), rng.uniform(-0.6, 0.6, count)
    tilt = np.radians(slope_deg)
    return np.column_stack((x, y, np.tan(tilt) * (x - 0.3))), np.array([-np.sin(tilt), 0.0, np.cos(tilt)])


def block(rng, count, height, edge=0.7):
    """Points (n, 3) m on level ground with a step up at x = edge."""
    points, _ = ground(rng, count)
    points[points[:, 0] > edge, 2] = height
    return points


def degrees_between(normals, true):
    return np.degrees(np.arccos(np.clip(normals @ true, -1.0, 1.0)))
