"""Support region and margin of one sample as CasADi expressions, mapped over the samples of a horizon.

The convex hull of at most four points needs no sorting: foot i is a corner
when some other foot j has all the rest on its left, seen from i, and then
i to j is the edge that leaves it counter-clockwise. Each foot so owns one of
the four rows of the region, which keeps its size fixed.
"""

from __future__ import annotations

import itertools
from functools import cache
from typing import Any, NamedTuple

import casadi as ca

from bluefoot_mpc.codegen import compiled

FAR = 1e3
"""m, offset of a row that constrains nothing."""
_FLAT = 1e-9
"""m², twice the area of three feet under which they count as standing on one line."""
_LEGS = range(4)
_RING = (0, 2, 3, 1)
"""House order of legs FL, FR, RL, RR put into counter-clockwise order."""


@cache
def region_function(samples: int) -> ca.Function:
    """Regions of `samples` samples, compiled where that is possible.

    Columns are samples. Inputs: feet (8, x and y of each), stance (4, 0 or 1),
    margin (1, m) and half width (1, m). Outputs: normals (8), offsets (4),
    offsets without the margin (4), edges (16: two ends of each row's edge),
    centre (2).
    """
    feet, stance = ca.SX.sym("feet", 8), ca.SX.sym("stance", 4)
    margin, half_width = ca.SX.sym("margin"), ca.SX.sym("half_width")
    outputs = region(feet, stance, margin, half_width)
    single = ca.Function("support_region", [feet, stance, margin, half_width], outputs, {"cse": True})
    mapped: ca.Function = single.map(f"support_regions_{samples}", "serial", samples, [2, 3], [])
    return compiled(mapped)


@cache
def margin_function(samples: int) -> ca.Function:
    """Signed margins of `samples` points, compiled where that is possible.

    Columns are samples. Inputs: point (2), normals (8), offsets without a
    margin (4), edges (16). Output: margin (1, m), + inside.
    """
    point, normals = ca.SX.sym("point", 2), ca.SX.sym("normals", 8)
    offsets, edges = ca.SX.sym("offsets", 4), ca.SX.sym("edges", 16)
    outputs = [_margin(point, normals, offsets, edges)]
    single = ca.Function("support_margin", [point, normals, offsets, edges], outputs)
    mapped: ca.Function = single.map(f"support_margins_{samples}", "serial", samples, [], [])
    return compiled(mapped)


def region(feet: Any, stance: Any, margin: Any, half_width: Any) -> list[Any]:
    """Normals, offsets, offsets without the margin, edges and centre of one sample.

    Args:
        feet: 8 m, x and y of each foot.
        stance: 4, one where the foot stands.
        margin: m, by which rows are pulled in, at most to the centre.
        half_width: m, of the strip around feet on one line.
    """
    points = [feet[2 * leg : 2 * leg + 2] for leg in _LEGS]
    ways = {(a, b): points[b] - points[a] for a, b in itertools.combinations(_LEGS, 2)}
    ways |= {(b, a): -way for (a, b), way in ways.items()}
    squares = {pair: ca.sumsqr(ways[min(pair), max(pair)]) for pair in ways}
    feet_now = _Feet(points, stance, ways, squares)
    turns = _turns(ways)
    centre = sum(stance[leg] * points[leg] for leg in _LEGS) / ca.fmax(ca.sum1(stance), 1.0)
    area = 0.0
    for triple in itertools.combinations(_LEGS, 3):
        standing = stance[triple[0]] * stance[triple[1]] * stance[triple[2]]
        area = ca.fmax(area, standing * ca.fabs(turns[triple]))
    polygon = _polygon(feet_now, turns, centre, margin)
    line = _line(feet_now, margin, half_width)
    is_polygon = area > _FLAT
    return [*(ca.if_else(is_polygon, a, b) for a, b in zip(polygon, line, strict=True)), centre]


class _Feet(NamedTuple):
    """Feet of one sample: points, stance flags, and ways and squared distances between pairs."""

    points: list[Any]
    stance: Any
    ways: dict[tuple[int, int], Any]
    squares: dict[tuple[int, int], Any]


def _turns(ways: dict[tuple[int, int], Any]) -> dict[tuple[int, ...], Any]:
    """Twice the signed area of every ordered triple; each computed once, so that signs never disagree."""
    turns: dict[tuple[int, ...], Any] = {}
    for a, b, c in itertools.combinations(_LEGS, 3):
        u, v = ways[a, b], ways[a, c]
        area = u[0] * v[1] - u[1] * v[0]
        for even in ((a, b, c), (b, c, a), (c, a, b)):
            turns[even] = area
        for odd in ((b, a, c), (a, c, b), (c, b, a)):
            turns[odd] = -area
    return turns


def _polygon(feet: _Feet, turns: dict[tuple[int, ...], Any], centre: Any, margin: Any) -> list[Any]:
    """Normals, offsets, offsets without margin and edges of the hull of three or four feet."""
    normals, offsets, plain, starts, ends = [], [], [], [], []
    spare = ca.vertcat(feet.points[0], feet.points[0])
    founds = []
    for leg in _LEGS:
        point = feet.points[leg]
        found, way = _edge(leg, feet, turns)
        length = ca.sqrt(ca.if_else(found, ca.sumsqr(way), 1.0))
        normal = ca.if_else(found, ca.vertcat(way[1], -way[0]) / length, ca.vertcat(1.0, 0.0))
        offset = ca.dot(normal, point)
        normals.append(normal)
        plain.append(ca.if_else(found, offset, FAR))
        offsets.append(ca.if_else(found, ca.fmax(offset - margin, ca.dot(normal, centre)), FAR))
        starts.append(point)
        ends.append(point + way)
        founds.append(found)
        spare = ca.if_else(found, ca.vertcat(point, point + way), spare)
    edges = [
        ca.if_else(found, ca.vertcat(start, end), spare)
        for found, start, end in zip(founds, starts, ends, strict=True)
    ]
    return [ca.vertcat(*normals), ca.vertcat(*offsets), ca.vertcat(*plain), ca.vertcat(*edges)]


def _edge(leg: int, feet: _Feet, turns: dict[tuple[int, ...], Any]) -> tuple[Any, Any]:
    """Whether an edge of the hull leaves this foot counter-clockwise, and its way (m)."""
    place = _RING.index(leg)
    found, way = 0.0, ca.SX.zeros(2)
    # The last foot of the ring first, the next one overrules: of two on one line either gives the same row.
    for other in (_RING[(place + step) % 4] for step in (3, 2, 1)):
        valid = ca.logic_and(feet.stance[other], feet.squares[leg, other] > _FLAT)
        for k in set(_LEGS) - {leg, other}:
            valid = ca.logic_and(valid, ca.logic_or(1.0 - feet.stance[k], turns[leg, other, k] >= 0.0))
        way = ca.if_else(valid, feet.ways[leg, other], way)
        found = ca.logic_or(found, valid)
    return ca.logic_and(found, feet.stance[leg]), way


def _first_standing(points: list[Any], stance: Any) -> Any:
    point = points[3]
    for leg in (2, 1, 0):
        point = ca.if_else(stance[leg] > 0.5, points[leg], point)
    return point


def _line(feet: _Feet, margin: Any, half_width: Any) -> list[Any]:
    """The same for feet on one line: a strip around it, which ends at the outermost feet."""
    points, stance = feet.points, feet.stance
    start = end = _first_standing(points, stance)
    longest = 0.0
    for a, b in itertools.combinations(_LEGS, 2):
        length = stance[a] * stance[b] * feet.squares[a, b]
        longer = length > longest
        start, end = ca.if_else(longer, points[a], start), ca.if_else(longer, points[b], end)
        longest = ca.if_else(longer, length, longest)
    has_length = longest > _FLAT
    length = ca.sqrt(ca.if_else(has_length, longest, 1.0))
    way = ca.if_else(has_length, (end - start) / length, ca.vertcat(1.0, 0.0))
    side = ca.vertcat(way[1], -way[0])
    middle = 0.5 * (start + end)
    normals: list[Any] = []
    offsets, plain = [], []
    for normal, tip in ((side, start), (-side, end), (way, end), (-way, start)):
        along = ca.dot(normal, tip)
        is_end = len(normals) >= 2
        offset = ca.fmax(along - margin, ca.dot(normal, middle)) if is_end else along
        normals.append(normal)
        offsets.append(offset + half_width)
        plain.append(along)
    edges = [start, end] * 4
    return [ca.vertcat(*normals), ca.vertcat(*offsets), ca.vertcat(*plain), ca.vertcat(*edges)]


def _margin(point: Any, normals: Any, offsets: Any, edges: Any) -> Any:
    inside, nearest = 1.0, ca.inf
    for row in _LEGS:
        inside = inside * (ca.dot(normals[2 * row : 2 * row + 2], point) <= offsets[row])
        start, end = edges[4 * row : 4 * row + 2], edges[4 * row + 2 : 4 * row + 4]
        way = end - start
        square = ca.sumsqr(way)
        share = ca.dot(point - start, way) / ca.if_else(square > 0.0, square, 1.0)
        gap = point - start - ca.fmin(1.0, ca.fmax(0.0, share)) * way
        nearest = ca.fmin(nearest, ca.sumsqr(gap))
    distance = ca.sqrt(nearest)
    return ca.if_else(inside > 0.5, distance, -distance)
