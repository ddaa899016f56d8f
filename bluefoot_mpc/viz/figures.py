"""The paper's figures: oscillators, footfall patterns, and the trunk's motion under the ZMP law.

Every function draws one figure from data and gives it back; `write_figures`
stores those that need no run, `write_trunk_figure` the one that does.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection, PatchCollection
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from bluefoot_mpc.gait.figures import (
    CpgSeries,
    FootfallPattern,
    cpg_series,
    footfall_pattern,
    transition_series,
)
from bluefoot_mpc.geometry import convex_hull
from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.types import LEGS
from bluefoot_mpc.viz.packing import stretches
from bluefoot_mpc.viz.series import RunSeries, extract
from bluefoot_mpc.viz.style import (
    COM,
    COMMAND,
    LEG_COLOURS,
    LEG_NAMES,
    SUPPORT,
    TRUTH,
    ZMP,
    figure_style,
    leg_colour,
)

FORMATS = ("png", "svg")
_TRIANGLE = 3


def write_figures(robot: RobotModel, folder: Path, formats: Sequence[str] = FORMATS) -> list[Path]:
    """Draw the gait figures of the paper.

    Oscillator series and phase portraits of trot, walk and the change between
    them, and the footfall patterns of both gaits at 40 mm/s.

    Args:
        robot: gives the stance whose feet walk.
        folder: where to; made when missing.
        formats: file types.

    Returns:
        The files written.
    """
    stance = robot.parameters.stance.foot_position
    patterns = [footfall_pattern(gait, stance) for gait in ("trot", "walk")]
    change = transition_series("trot", "walk")
    with figure_style():
        figures = {
            "cpg-trot": cpg_figure(cpg_series("trot")),
            "cpg-walk": cpg_figure(cpg_series("walk")),
            "cpg-transition": cpg_figure(change),
            "footfall": footfall_figure(patterns),
        }
        return [path for name, figure in figures.items() for path in save(figure, folder, name, formats)]


def write_trunk_figure(
    run: RunData,
    robot: RobotModel,
    folder: Path,
    *,
    start: float,
    duration: float,
    formats: Sequence[str] = FORMATS,
) -> list[Path]:
    """Draw the trunk's motion under the ZMP law from a run.

    Args:
        run: a walking run.
        robot: the robot that ran.
        folder: where to; made when missing.
        start: s, beginning of the stretch shown.
        duration: s, its length.
        formats: file types.

    Returns:
        The files written.
    """
    series = extract(run, robot.parameters.servo.stall_torque)
    with figure_style():
        return save(trunk_figure(series, start, duration), folder, "trunk-motion", formats)


def cpg_figure(series: CpgSeries) -> Figure:
    """Oscillator states over time (left) and their phase portraits (right)."""
    figure = Figure(figsize=(8.4, 4.6))
    grid = figure.add_gridspec(4, 2, width_ratios=[2.3, 1.0])
    rows = [figure.add_subplot(grid[index, 0]) for index in range(len(LEGS))]
    for index, (axes, leg) in enumerate(zip(rows, LEGS, strict=True)):
        colour = leg_colour(index)
        axes.sharex(rows[0])
        axes.fill_between(
            series.time,
            0.0,
            series.y2[:, index],
            where=series.y2[:, index] > 0.0,
            color=colour,
            alpha=0.18,
            lw=0,
        )
        axes.plot(series.time, series.y1[:, index], color=colour, lw=1.0, ls="--")
        axes.plot(series.time, series.y2[:, index], color=colour)
        axes.set_ylabel(leg, rotation=0, ha="right", va="center", color=colour, fontweight="bold")
        axes.set_ylim(-1.35, 1.35)
        axes.tick_params(labelbottom=index == len(LEGS) - 1)
        _shade_blend(axes, series)
    rows[0].set_title(f"{series.gait}: $y_1$ dashed, $y_2$ full; shaded while the leg swings")
    rows[-1].set_xlabel("time (s)")
    portrait = figure.add_subplot(grid[:, 1])
    for index, leg in enumerate(LEGS):
        portrait.plot(
            series.y1[:, index], series.y2[:, index], color=leg_colour(index), lw=0.9, label=leg, alpha=0.85
        )
    portrait.axhline(0.0, color="#aab2bf", lw=0.8)
    portrait.set(aspect="equal", xlabel="$y_1$", ylabel="$y_2$", xlim=(-1.4, 1.4), ylim=(-1.4, 1.4))
    portrait.set_title("phase portrait")
    portrait.legend(
        loc="lower center", bbox_to_anchor=(0.5, -0.5), ncols=4, handlelength=1.2, columnspacing=1.0
    )
    return figure


def footfall_figure(patterns: Sequence[FootfallPattern]) -> Figure:
    """Footfall patterns, one gait below the other; bars while the foot stands."""
    figure = Figure(figsize=(8.4, 1.9 * len(patterns)))
    for row, (axes, pattern) in enumerate(
        zip(figure.subplots(len(patterns), 1, squeeze=False)[:, 0], patterns, strict=True)
    ):
        period = float(pattern.time[1] - pattern.time[0])
        for index, leg in enumerate(LEGS):
            spans = stretches(pattern.stance[:, index], pattern.time, period)
            bars = [(begin, end - begin) for begin, end in spans]
            axes.broken_barh(bars, (len(LEGS) - 1 - index - 0.3, 0.6), facecolors=LEG_COLOURS[leg], lw=0)
        axes.set_yticks(range(len(LEGS)), [LEG_NAMES[leg] for leg in reversed(LEGS)])
        axes.set_xlim(0.0, float(pattern.time[-1]))
        axes.grid(axis="y", visible=False)
        duty = ", ".join(f"{share:.2f}" for share in pattern.duty)
        axes.set_title(
            f"{pattern.gait} at {1e3 * pattern.speed:.0f} mm/s: cycle {pattern.cycle_time:.2f} s, duty {duty}"
        )
        if row == len(patterns) - 1:
            axes.set_xlabel("time (s)")
    return figure


def trunk_figure(series: RunSeries, start: float, duration: float) -> Figure:
    """Planned and real trunk path with ZMP and support polygons from above, and sideways over time."""
    pick = (series.time >= start) & (series.time <= start + duration)
    figure = Figure(figsize=(8.4, 6.2))
    above, sideways = figure.subplots(2, 1, height_ratios=[1.6, 1.0])
    _draw_support(above, series, pick)
    where = np.flatnonzero(pick)
    for index, leg in enumerate(LEGS):
        stands = where[series.loaded[where, index]]
        above.plot(*series.feet[stands, index, :2].T, ".", color=leg_colour(index), ms=5, label=leg)
    lines = [
        ("trunk, planned", series.reference, COMMAND, "--"),
        ("trunk", series.q[:, :2], TRUTH, "-"),
        ("centre of mass", series.com[:, :2], COM, "-"),
        ("ZMP assumed", series.zmp_plan, ZMP, "-"),
    ]
    for name, points, colour, dash in lines:
        if np.isfinite(points[pick]).any():
            above.plot(points[pick, 0], points[pick, 1], color=colour, ls=dash, lw=1.5, label=name)
            sideways.plot(series.time[pick], 1e3 * points[pick, 1], color=colour, ls=dash, lw=1.4)
    above.set(aspect="equal", xlabel="x, forward (m)", ylabel="y, left (m)")
    above.set_title("from above: support polygons, trunk, centre of mass and ZMP")
    above.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=4)
    sideways.set(xlabel="time (s)", ylabel="y, left (mm)", xlim=(start, start + duration))
    sideways.set_title("sideways motion")
    return figure


def save(figure: Figure, folder: Path, name: str, formats: Iterable[str] = FORMATS) -> list[Path]:
    """Write a figure in every format; no date goes in, so that equal data gives equal files."""
    folder.mkdir(parents=True, exist_ok=True)
    FigureCanvasAgg(figure)
    written = []
    for kind in formats:
        path = folder / f"{name}.{kind}"
        figure.savefig(path, metadata={"Date": None} if kind == "svg" else {"Software": None})
        written.append(path)
    return written


def _shade_blend(axes: Axes, series: CpgSeries) -> None:
    changing = (series.blend > 0.0) & (series.blend < 1.0)
    for begin, end in stretches(changing, series.time, float(series.time[1] - series.time[0])):
        axes.axvspan(begin, end, color="#8a94a6", alpha=0.14, lw=0)


def _draw_support(axes: Axes, series: RunSeries, pick: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> None:
    """Support while a leg swings, once for each change: triangles, or lines on two feet."""
    hulls: list[Polygon] = []
    lines = []
    before = None
    for k in np.flatnonzero(pick):
        stance = tuple(bool(s) for s in series.scheduled[k])
        if stance == before or not any(stance):
            continue
        before = stance
        corners = convex_hull(series.feet[k, list(stance), :2])
        if len(corners) == _TRIANGLE:
            hulls.append(Polygon(corners))
        elif len(corners) < _TRIANGLE:
            lines.append(corners)
    axes.add_collection(PatchCollection(hulls, facecolor=SUPPORT, alpha=0.05, edgecolor="none"))
    axes.add_collection(PatchCollection(hulls, facecolor="none", edgecolor=SUPPORT, lw=0.5, alpha=0.7))
    axes.add_collection(LineCollection(lines, colors=SUPPORT, lw=0.6, alpha=0.8))
