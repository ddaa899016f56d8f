"""Rows of the preview's problem and their values on a path, as CasADi functions over all samples."""

from __future__ import annotations

from functools import cache
from typing import Any

import casadi as ca

from bluefoot_mpc.codegen import compiled
from bluefoot_mpc.zmp.support_symbols import region

_ROWS = range(4)
_SWEEPS = 2
"""Times that a point is led over the four rows into a region; a corner needs the second."""


@cache
def rows_function(samples: int) -> ca.Function:
    """Rows and wanted ZMP of every sample.

    Columns are samples. Inputs: feet (8), stance (4), nominal (2), heading (2:
    cosine, sine), reach (2), and for all samples together margin, half width,
    depth and pull (4 x 1). Outputs: wanted ZMP (2); of the support normals (8),
    offsets (4), offsets without margin (4), edges (16); of the reach
    normals (8), offsets (4).
    """
    feet, stance, nominal = ca.SX.sym("feet", 8), ca.SX.sym("stance", 4), ca.SX.sym("nominal", 2)
    heading, reach, choices = ca.SX.sym("heading", 2), ca.SX.sym("reach", 2), ca.SX.sym("choices", 4)
    margin, half_width, depth, pull = ca.vertsplit(choices)
    normals, offsets, plain, edges, centre = region(feet, stance, margin, half_width)
    wanted = _inward(nominal, normals, offsets, centre, depth)
    wanted = wanted + pull * (centre - wanted)
    box = ca.vertcat(heading, -heading, -heading[1], heading[0], heading[1], -heading[0])
    sides = [ca.dot(box[2 * row : 2 * row + 2], nominal) + reach[row // 2] for row in _ROWS]
    single = ca.Function(
        "preview_row",
        [feet, stance, nominal, heading, reach, choices],
        [wanted, normals, offsets, plain, edges, box, ca.vertcat(*sides)],
        {"cse": True},
    )
    return compiled(single.map(f"preview_rows_{samples}", "serial", samples, [5], []))


@cache
def residual_function(samples: int) -> ca.Function:
    """How far a path lies inside the rows.

    Columns are samples. Inputs: position (2), acceleration (2), lever (1),
    normals and offsets of support and reach (8, 4, 8, 4), and for all samples
    together horizontal gravity (2 x 1) and the velocity at the end (2 x 1).
    Outputs: ZMP (2), residuals of support (4), reach (4) and of the capture
    point in the last region (4 x 1).
    """
    position, acceleration, lever = ca.SX.sym("p", 2), ca.SX.sym("a", 2), ca.SX.sym("lever")
    support, offsets = ca.SX.sym("support", 8), ca.SX.sym("offsets", 4)
    reach, sides = ca.SX.sym("reach", 8), ca.SX.sym("sides", 4)
    gravity = ca.SX.sym("gravity", 2)
    zmp = position - lever * (acceleration - gravity)
    single = ca.Function(
        "preview_residual",
        [position, acceleration, lever, support, offsets, reach, sides, gravity],
        [zmp, _residuals(zmp, support, offsets), _residuals(position, reach, sides)],
    )
    mapped = single.map(f"preview_residual_map_{samples}", "serial", samples, [7], [])
    inputs = [ca.MX.sym(name, *mapped.size_in(k)) for k, name in enumerate(mapped.name_in())]
    velocity = ca.MX.sym("velocity", 2)
    capture = inputs[0][:, -1] + ca.sqrt(inputs[2][-1]) * velocity + inputs[2][-1] * inputs[7]
    last = _residuals(capture, inputs[3][:, -1], inputs[4][:, -1])
    return compiled(
        ca.Function(f"preview_residuals_{samples}", [*inputs, velocity], [*mapped(*inputs), last])
    )


def _residuals(point: Any, normals: Any, offsets: Any) -> Any:
    return offsets - ca.vertcat(*(ca.dot(normals[2 * row : 2 * row + 2], point) for row in _ROWS))


def _inward(point: Any, normals: Any, offsets: Any, centre: Any, depth: Any) -> Any:
    """The point led into the region until `depth` from its rows, at most to the region's centre."""
    for row in [*_ROWS] * _SWEEPS:
        normal = normals[2 * row : 2 * row + 2]
        wall = ca.fmax(offsets[row] - depth, ca.fmin(offsets[row], ca.dot(normal, centre)))
        point = point - ca.fmax(ca.dot(normal, point) - wall, 0.0) * normal
    return point
