"""The report's figures of model-based control: planned forces, torques and motion, and how solving went."""

from __future__ import annotations

from typing import Any

import numpy as np

from bluefoot_mpc.types import LEG_JOINTS, LEGS, Fallback, FloatArray
from bluefoot_mpc.viz.packing import pack
from bluefoot_mpc.viz.plan_series import PlanSeries
from bluefoot_mpc.viz.plots import Panel, Trace, curve, gait_window, name_rows, rows
from bluefoot_mpc.viz.plots_ground import last_steps, support_outlines
from bluefoot_mpc.viz.series import RunSeries
from bluefoot_mpc.viz.style import BAD, COM, COMMAND, ESTIMATE, LEG_COLOURS, LEG_NAMES, WARNING, ZMP

_STRETCH = 3.0
"""s of walking whose plan is drawn from above."""
_LEG = 0
"""The leg whose torques are shown."""


def plan_panels(series: RunSeries, plans: PlanSeries) -> list[Panel]:
    """All figures of the plans of a run."""
    panels = [forces(series, plans), planned_torques(series, plans)] if plans.has_forces else []
    if plans.has_motion:
        panels.append(planned_path(series, plans))
    return [*panels, solving(series, plans)]


def forces(series: RunSeries, plans: PlanSeries) -> Panel:
    """Planned vertical ground force of each foot against the true one."""
    traces: list[Trace] = []
    layout = rows(len(LEGS), ["force (N)"] * len(LEGS), gap=0.055)
    for leg, name in enumerate(LEGS):
        axis = "y" if leg == 0 else f"y{leg + 1}"
        lines = [("planned", plans.load[:, leg], LEG_COLOURS[name], 1.8)]
        if series.has_truth:
            lines.insert(0, ("true", plans.load_truth[:, leg], "@ink", 1.0))
        for kind, values, colour, width in lines:
            trace = curve(series.time, values, f"{name} {kind}", colour, axis=axis, width=width)
            traces.append({**trace, "showlegend": False})
        layout["yaxis" if leg == 0 else f"yaxis{leg + 1}"]["rangemode"] = "tozero"
    name_rows(layout, [LEG_NAMES[name] for name in LEGS], [LEG_COLOURS[name] for name in LEGS])
    error = _rms(plans.load - plans.load_truth)
    against = f", black: the true one; they differ by {error:.1f} N RMS" if series.has_truth else ""
    window = _pages(layout, series)
    return Panel(
        key="forces", title="Planned ground forces", data=traces, layout=layout, height=460, wide=True,
        window=window,
        caption=f"Coloured: vertical force that the whole-body problem plans for each foot{against}. "
        "Turns its pages with the replay.",
    )  # fmt: skip


def planned_torques(series: RunSeries, plans: PlanSeries) -> Panel:
    """Planned torques of one leg against what its motors made."""
    traces: list[Trace] = []
    layout = rows(len(LEG_JOINTS), ["torque (N·m)"] * len(LEG_JOINTS), gap=0.055)
    for index in range(len(LEG_JOINTS)):
        axis, joint = "y" if index == 0 else f"y{index + 1}", 4 * _LEG + index
        for kind, values, colour in (
            ("motor", series.torque[:, joint], "@ink"),
            ("planned", plans.torque[:, joint], COMMAND),
        ):
            trace = curve(series.time, values, kind, colour, axis=axis, width=1.2)
            traces.append({**trace, "legendgroup": kind, "showlegend": index == 0})
    name_rows(layout, [name.replace("_", " ") for name in LEG_JOINTS], ["@ink"] * len(LEG_JOINTS))
    error = _rms(plans.torque - series.torque)
    motor = "what the motors make at the shafts" if series.has_truth else "the load that the servos report"
    window = _pages(layout, series)
    return Panel(
        key="planned-torques", title=f"Planned torques, {LEG_NAMES[LEGS[_LEG]]} leg", data=traces,
        layout=layout, height=560, wide=True, window=window,
        caption=f"Against {motor}. Over all sixteen joints they differ by {error:.2f} N·m RMS: the plan "
        "knows neither dry friction nor the lag of the servos.",
    )  # fmt: skip


def planned_path(series: RunSeries, plans: PlanSeries) -> Panel:
    """Planned and true centre of mass and ZMP from above, over the last steps' support."""
    pick = last_steps(series, _STRETCH)
    lines = [
        ("centre of mass, planned", plans.com, COM, "dash"),
        ("ZMP, planned", series.zmp_plan, ZMP, "dash"),
    ]
    if series.has_truth:
        lines += [("centre of mass", series.com[:, :2], COM, "solid"), ("ZMP", series.zmp, ZMP, "solid")]
    traces = [support_outlines(series, _STRETCH)]
    for name, points, colour, dash in lines:
        traces.append(
            {
                "type": "scatter",
                "mode": "lines",
                "x": pack(points[pick, 0]),
                "y": pack(points[pick, 1]),
                "name": name,
                "line": {"color": colour, "width": 1.8 if dash == "dash" else 1.1, "dash": dash},
                "hovertemplate": "x %{x:.3f} m, y %{y:.3f} m",
            }
        )
    layout = {
        "xaxis": {"title": {"text": "x, forward at the start (m)"}},
        "yaxis": {"title": {"text": "y, left (m)"}, "scaleanchor": "x", "scaleratio": 1},
        "hovermode": "closest",
    }
    return Panel(
        key="planned-path", title="Plan from above", data=traces, layout=layout, height=430, time=False,
        caption=f"The last {_STRETCH:g} s of walking: dashed as planned, full as it was, over the "
        "polygons of the feet that stand.",
    )  # fmt: skip


def solving(series: RunSeries, plans: PlanSeries) -> Panel:
    """Rung of the ladder over time, failures and late ticks so far."""
    stages = [("preview", plans.preview, ESTIMATE, 2.6), ("whole body", plans.whole_body, COMMAND, 1.4)]
    traces: list[Trace] = []
    for name, rungs, colour, width in stages:
        if np.isfinite(rungs).any():
            traces.append({**curve(series.time, rungs, name, colour, width=width), "hovertemplate": "%{y}"})
    for name, counts, colour in (("failures", plans.failures, BAD), ("late ticks", plans.late, WARNING)):
        traces.append(curve(series.time, counts, name, colour, axis="y2"))
    layout = rows(2, ["", "count so far"], gap=0.12)
    layout["yaxis"] |= {
        "tickvals": [int(rung) for rung in Fallback],
        "ticktext": [rung.name.lower() for rung in Fallback],
        "range": [4.4, -0.4],
        "fixedrange": True,
    }
    most = max(1.0, float(plans.failures[-1]), float(plans.late[-1]))
    layout["yaxis2"] |= {"range": [-0.05 * most, 1.15 * most]}
    return Panel(
        key="solving", title="Where plans come from", data=traces, layout=layout, height=430,
        caption="Each step down is further from the optimum: nearest feasible point, last plan, static "
        "stance, sitting down.",
    )  # fmt: skip


def _pages(layout: dict[str, Any], series: RunSeries) -> float:
    """Show the window of the gait first; gives its length, s."""
    window = gait_window(series)
    layout["xaxis"]["range"] = window
    return window[1] - window[0]


def _rms(values: FloatArray) -> float:
    """Root mean square of what is a number; NaN where nothing is."""
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(np.square(known)))) if known.size else float("nan")
