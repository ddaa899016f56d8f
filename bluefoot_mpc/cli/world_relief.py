"""Rough ground from above: heights in words and in pictures."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from bluefoot_mpc.cli.world_picture import ROBOT_SHAPES, filled
from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.sim.worlds.heights import heights
from bluefoot_mpc.sim.worlds.plan import WorldPlan
from bluefoot_mpc.types import FloatArray
from bluefoot_mpc.viz.style import ESTIMATE, figure_style

_CELL = 0.005
"""m, side of a picture's cell."""
_STEP = 0.001
"""m; ground that differs by less from the start's is as even as the start."""


def tell_relief(plan: WorldPlan) -> list[str]:
    """Lines that tell where rough ground lies, and how high and low it is.

    Args:
        plan: of the world.
    """
    x, _, height = _sampled(plan)
    rough = np.abs(height) > _STEP
    if not rough.any():
        return ["the ground is even"]
    columns = np.flatnonzero(rough.any(axis=0))
    low, high = 1e3 * height.min(), 1e3 * height.max()
    return [
        f"ground between {low:.0f} and {high:.0f} mm, where the start is at 0 mm;"
        f" rough from x = {x[columns[0]]:.2f} to {x[columns[-1]]:.2f} m"
    ]


def save_relief_picture(plan: WorldPlan, file: Path) -> None:
    """Draw the heights of rough ground from above; a page (.html) tells them under the pointer.

    Args:
        plan: of the world.
        file: where to; its ending tells the kind.

    Raises:
        ConfigurationError: the file cannot be written.
    """
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        if file.suffix == ".html":
            file.write_text(_page(plan), encoding="utf-8")
        else:
            _save_picture(plan, file)
    except OSError as error:
        raise ConfigurationError(f"cannot write {file}: {error.strerror or error}") from error


def _sampled(plan: WorldPlan) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Middles of cells along x and y (m), and heights (rows along y, columns along x), m in world."""
    x0, y0, x1, y1 = plan.bounds
    x, y = np.arange(x0 + 0.5 * _CELL, x1, _CELL), np.arange(y0 + 0.5 * _CELL, y1, _CELL)
    return x, y, heights(plan, np.stack(np.meshgrid(x, y), axis=-1))


def _title(plan: WorldPlan) -> str:
    x0, y0, x1, y1 = plan.bounds
    return f"{plan.name}, seed {plan.seed}: {x1 - x0:.1f} × {y1 - y0:.1f} m"


def _save_picture(plan: WorldPlan, file: Path) -> None:
    from matplotlib.figure import Figure  # noqa: PLC0415
    from matplotlib.patches import Polygon  # noqa: PLC0415

    _, _, height = _sampled(plan)
    x0, y0, x1, y1 = plan.bounds
    with figure_style():
        figure = Figure(figsize=(5.2, 5.2 * min(1.5, max(0.45, (y1 - y0) / (x1 - x0))) + 0.5), dpi=100)
        axes = figure.add_subplot()
        image = axes.imshow(
            1e3 * height, origin="lower", extent=(x0, x1, y0, y1), interpolation="nearest", cmap="cividis"
        )
        for shape in ROBOT_SHAPES:
            axes.add_patch(Polygon(shape, facecolor=ESTIMATE, edgecolor="none"))
        axes.set(xlabel="x (m)", ylabel="y (m)", title=_title(plan))
        axes.set_aspect("equal")
        axes.grid(visible=False)
        figure.colorbar(image, ax=axes, label="height (mm)", shrink=0.7)
        figure.savefig(file, dpi=100)


def _page(plan: WorldPlan) -> str:
    import plotly.io  # noqa: PLC0415

    x, y, height = _sampled(plan)
    ground: dict[str, Any] = {
        "type": "heatmap", "z": np.round(1e3 * height, 1).tolist(), "colorscale": "Cividis",
        "x0": float(x[0]), "dx": _CELL, "y0": float(y[0]), "dy": _CELL,
        "colorbar": {"title": {"text": "height (mm)"}},
        "hovertemplate": "x %{x:.3f} m<br>y %{y:.3f} m<br>%{z:.1f} mm<extra></extra>",
    }  # fmt: skip
    layout = {
        "title": {"text": _title(plan)}, "plot_bgcolor": "white", "showlegend": False,
        "xaxis": {"title": {"text": "x (m)"}, "showgrid": False, "zeroline": False},
        "yaxis": {"title": {"text": "y (m)"}, "showgrid": False, "zeroline": False, "scaleanchor": "x"},
    }  # fmt: skip
    figure = {"data": [ground, *(filled(shape) for shape in ROBOT_SHAPES)], "layout": layout}
    return str(plotly.io.to_html(figure, include_plotlyjs=True, full_html=True, validate=False))
