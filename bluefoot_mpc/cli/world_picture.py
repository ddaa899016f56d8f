"""Pictures of worlds from above: what stands, what hangs, where the robot gets, what it sees at first."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.sim.worlds.coverage import LIDAR_RANGE, Grid, visible
from bluefoot_mpc.sim.worlds.plan import Solid, WorldPlan
from bluefoot_mpc.types import BoolArray, FloatArray
from bluefoot_mpc.viz.plots_map import solid_traces
from bluefoot_mpc.viz.style import ESTIMATE, figure_style
from bluefoot_mpc.viz.surroundings import css_colour, hangs_over, outline

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_HALF_SECTOR = math.radians(119.9)
ROBOT_SHAPES = (
    np.array([[0.19, 0.19], [-0.19, 0.19], [-0.19, -0.19], [0.19, -0.19]]),
    np.array([[0.30, 0.0], [0.19, 0.07], [0.19, -0.07]]),
)
"""(k, 2) m each: the robot at its start from above, and its nose."""

_SEEN, _UNSEEN, _OUT_OF_REACH = (0.99, 0.96, 0.83), (0.93, 0.95, 0.97), (0.82, 0.84, 0.87)
_FLOORS = {
    "seen from the start": _SEEN,
    "not seen from the start": _UNSEEN,
    "out of the robot's reach": _OUT_OF_REACH,
}


def save_world_picture(plan: WorldPlan, grid: Grid, file: Path) -> None:
    """Draw a world; a page (.html) tells the names of things under the pointer.

    Args:
        plan: of the world.
        grid: its floor.
        file: where to; its ending tells the kind.

    Raises:
        ConfigurationError: the file cannot be written.
    """
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        if file.suffix == ".html":
            file.write_text(_page(plan, grid), encoding="utf-8")
        else:
            _save_picture(plan, grid, file)
    except OSError as error:
        raise ConfigurationError(f"cannot write {file}: {error.strerror or error}") from error


def seen_at_first(plan: WorldPlan, grid: Grid) -> BoolArray:
    """(rows, columns) True where the LIDAR sees the floor from the start, by geometry."""
    points = grid.points()
    seen = visible(plan.solids, np.zeros(2), points)
    seen &= np.hypot(points[:, 0], points[:, 1]) <= LIDAR_RANGE
    seen &= np.abs(np.arctan2(points[:, 1], points[:, 0])) <= _HALF_SECTOR
    return seen.reshape(grid.floor.shape) & grid.floor


def title(plan: WorldPlan, grid: Grid) -> str:
    """One line over the picture."""
    x0, y0, x1, y1 = plan.bounds
    size = f"{x1 - x0:.1f} × {y1 - y0:.1f} m"
    return f"{plan.name}, seed {plan.seed}: {size}, {grid.area:.0f} m² within reach"


def _save_picture(plan: WorldPlan, grid: Grid, file: Path) -> None:
    from matplotlib.figure import Figure  # noqa: PLC0415
    from matplotlib.patches import Patch  # noqa: PLC0415

    x0, y0, x1, y1 = plan.bounds
    with figure_style():
        figure = Figure(figsize=(5.2, 5.2 * min(1.5, max(0.6, (y1 - y0) / (x1 - x0))) + 0.5), dpi=100)
        axes = figure.add_subplot()
        image, extent = _image(plan, grid)
        axes.imshow(image, origin="lower", extent=extent, interpolation="nearest", zorder=0)
        # What hangs over other things is drawn over them.
        for solid in sorted(plan.solids, key=lambda solid: solid.z):
            _draw_solid(axes, solid)
        _draw_start_and_marker(axes, plan)
        axes.set(xlim=(x0 - 0.25, x1 + 0.25), ylim=(y0 - 0.25, y1 + 0.25), xlabel="x (m)", ylabel="y (m)")
        axes.set_aspect("equal")
        axes.grid(visible=False)
        axes.set_title(title(plan, grid))
        handles = [Patch(color=colour, label=name) for name, colour in _FLOORS.items()]
        figure.legend(handles=handles, loc="outside lower center", ncols=3)
        figure.savefig(file, dpi=100)


def _image(plan: WorldPlan, grid: Grid) -> tuple[FloatArray, tuple[float, float, float, float]]:
    """Colours of the floor's cells (rows, columns, 3), and the edges: left, right, bottom, top, m."""
    image = np.empty((*grid.floor.shape, 3))
    image[:] = _OUT_OF_REACH
    image[grid.floor] = _UNSEEN
    image[seen_at_first(plan, grid)] = _SEEN
    rows, columns = grid.floor.shape
    x, y = grid.corner
    return image, (x, x + columns * grid.cell, y, y + rows * grid.cell)


def _draw_solid(axes: Axes, solid: Solid) -> None:
    from matplotlib.patches import Polygon  # noqa: PLC0415

    edge = tuple(0.55 * part for part in solid.colour)
    hangs = hangs_over(solid)
    axes.add_patch(
        Polygon(
            outline(solid), facecolor=(*solid.colour, 0.30 if hangs else 1.0), edgecolor=edge,
            linewidth=0.7, linestyle="--" if hangs else "-", zorder=2,
        )
    )  # fmt: skip


def _draw_start_and_marker(axes: Axes, plan: WorldPlan) -> None:
    from matplotlib.patches import Circle, Polygon  # noqa: PLC0415

    for shape in ROBOT_SHAPES:
        axes.add_patch(Polygon(shape, facecolor=ESTIMATE, edgecolor="none", zorder=3))
    if (marker := plan.marker) is not None:
        at = (marker.x, marker.y)
        axes.add_patch(Circle(at, 0.5, facecolor="none", edgecolor=marker.colour, linestyle=":", zorder=3))
        axes.add_patch(Circle(at, marker.radius, facecolor=marker.colour, zorder=4))
        axes.annotate("marker", at, (0, 6), textcoords="offset points", ha="center", color=marker.colour)


def _page(plan: WorldPlan, grid: Grid) -> str:
    import plotly.io  # noqa: PLC0415

    value = grid.floor.astype(int) + seen_at_first(plan, grid)
    shades = [_OUT_OF_REACH, _UNSEEN, _SEEN]
    scale = [[edge / 3.0, css_colour(shade)] for k, shade in enumerate(shades) for edge in (k, k + 1)]
    floor: dict[str, Any] = {
        "type": "heatmap", "z": value.tolist(), "zmin": 0, "zmax": 2, "colorscale": scale,
        "x0": grid.corner[0] + 0.5 * grid.cell, "dx": grid.cell,
        "y0": grid.corner[1] + 0.5 * grid.cell, "dy": grid.cell,
        "showscale": False, "hoverinfo": "skip",
    }  # fmt: skip
    traces: list[dict[str, Any]] = [
        floor,
        *solid_traces(plan.solids),
        _names(plan),
        *(filled(shape) for shape in ROBOT_SHAPES),
    ]
    layout = {
        "title": {"text": title(plan, grid)}, "plot_bgcolor": "white", "hovermode": "closest",
        "xaxis": {"title": {"text": "x (m)"}, "showgrid": False, "zeroline": False},
        "yaxis": {"title": {"text": "y (m)"}, "showgrid": False, "zeroline": False, "scaleanchor": "x"},
        "showlegend": False,
    }  # fmt: skip
    if (marker := plan.marker) is not None:
        at = {"x": marker.x, "y": marker.y, "text": "marker", "showarrow": True}
        layout["annotations"] = [at]
        layout["shapes"] = [
            {
                "type": "circle", "x0": marker.x - marker.radius, "x1": marker.x + marker.radius,
                "y0": marker.y - marker.radius, "y1": marker.y + marker.radius,
                "fillcolor": css_colour(marker.colour), "line": {"width": 0},
            }
        ]  # fmt: skip
    figure = {"data": traces, "layout": layout}
    return str(plotly.io.to_html(figure, include_plotlyjs=True, full_html=True, validate=False))


def _names(plan: WorldPlan) -> dict[str, Any]:
    """Invisible points that tell the names of things under the pointer."""
    return {
        "type": "scatter", "mode": "markers", "marker": {"size": 14, "opacity": 0.0},
        "x": [solid.x for solid in plan.solids], "y": [solid.y for solid in plan.solids],
        "text": [solid.name for solid in plan.solids], "hoverinfo": "text",
    }  # fmt: skip


def filled(shape: FloatArray) -> dict[str, Any]:
    """A polygon (k, 2), m, in the robot's colour, as a page draws it."""
    closed = np.concatenate([shape, shape[:1]])
    return {
        "type": "scatter", "mode": "lines", "fill": "toself", "x": closed[:, 0].tolist(),
        "y": closed[:, 1].tolist(), "line": {"width": 0, "color": ESTIMATE}, "fillcolor": ESTIMATE,
        "hoverinfo": "skip",
    }  # fmt: skip
