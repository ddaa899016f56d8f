"""A bench as one self-contained page: verdict, ablations, limit of pushes, time of every layer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from bluefoot_mpc.viz.bench_level import level_panels, level_table, medians
from bluefoot_mpc.viz.page import embed_json, embed_script, render, template_text
from bluefoot_mpc.viz.plots import Panel, Trace
from bluefoot_mpc.viz.style import COM, COMMAND, ESTIMATE, GOOD, NEUTRAL, ZMP

COLOURS = (NEUTRAL, ESTIMATE, GOOD, COMMAND, COM, ZMP)
"""One colour per variant, in their order."""
_TOTALS = ("whole tick", "tick and simulation")
_SIMULATION = ("physics", "sensors and servos")

_POLAR = {
    "bgcolor": "rgba(0,0,0,0)",
    "angularaxis": {
        "rotation": 90, "direction": "counterclockwise", "gridcolor": "@line", "linecolor": "@line",
        "tickvals": [0, 90, 180, 270], "ticktext": ["forward", "left", "back", "right"],
    },
    "radialaxis": {"ticksuffix": " N·s", "gridcolor": "@line", "linecolor": "@line", "rangemode": "tozero"},
}  # fmt: skip
"""Seen from above, forward is up."""

Data = Mapping[str, Any]


def bench_html(data: Data) -> str:
    """The page as text.

    Args:
        data: what ``bluefoot bench --json`` prints.
    """
    panels = bench_panels(data)
    figures = {
        panel.key: {"data": panel.data, "layout": panel.layout, "time": False, "follow": False, "window": 0.0}
        for panel in panels
    }
    missed = [row for row in data["criteria"] if not row["holds"]]
    return render(
        "bench.html.j2",
        title="BlueFoot bench",
        headline=_headline(data, missed),
        status="" if not data["criteria"] else "bad" if missed else "good",
        facts=_facts(data),
        variants={**data["variants"], **(data["level"].get("parts") or {})},
        panels=panels,
        criteria=data["criteria"],
        rows=[_cells(row, data["cases"]) for row in data["ablation"]],
        level=level_table(data["level"]),
        timings=[_timing_table(name, columns) for name, columns in data["timing"].items()],
        versions=sorted(data["versions"].items()),
        figures=embed_json(figures),
        plotly_script=embed_script(_plotly_script()),
        report_script=embed_script(template_text("report.js")),
    )


def bench_panels(data: Data) -> list[Panel]:
    """Every figure that the data allow."""
    panels = []
    if data["ablation"]:
        panels += [tilt_panel(data), ratio_panel(data)]
    if data["level"]:
        panels += level_panels(data["level"])
    if data["pushes"]:
        panels.append(push_panel(data["pushes"], data["push_search"]))
    panels += [
        timing_panel(k, name, columns) for k, (name, columns) in enumerate(data["timing"].items()) if columns
    ]
    return panels


def tilt_panel(data: Data) -> Panel:
    """Bars of the median tilt of every variant in every case, whiskers to the best and the worst seed."""
    return Panel(
        key="tilt",
        title="How much the trunk tilts",
        caption="RMS of roll and pitch together, unsmoothed truth; bar: median seed, whisker: best to worst.",
        data=[_tilt_bars(data, index, variant) for index, variant in enumerate(data["variants"])],
        layout={"barmode": "group", "yaxis": {"title": {"text": "degrees RMS"}, "rangemode": "tozero"}},
        height=380,
        wide=True,
        time=False,
    )


def _tilt_bars(data: Data, index: int, variant: str) -> Trace:
    rows = [row for row in data["ablation"] if row["variant"] == variant]
    found = [row["figures"]["tilt_rms_deg"] for row in rows]
    return {
        "type": "bar",
        "name": variant,
        "x": [data["cases"][row["case"]] for row in rows],
        **medians(found),
        "marker": {"color": _colour(index)},
        "hovertemplate": "%{y:.2f}°",
    }


def ratio_panel(data: Data) -> Panel:
    """Tilt of every variant over that of the first, with its interval."""
    traces = [_ratios(data, index, variant) for index, variant in enumerate(data["variants"])]
    first = next(iter(data["variants"]), "")
    line = {"color": NEUTRAL, "width": 1, "dash": "dot"}
    return Panel(
        key="ratio",
        title=f"Tilt as a part of {first}'s",
        caption="Geometric mean over pairs of runs of the same seed, with its bootstrap 95 % interval.",
        data=[trace for trace in traces if trace["x"]],
        layout={
            "hovermode": "closest",
            "xaxis": {"title": {"text": f"tilt over that of {first}"}, "rangemode": "tozero"},
            "yaxis": {"autorange": "reversed"},
            "shapes": [{"type": "line", "yref": "paper", "x0": 1, "x1": 1, "y0": 0, "y1": 1, "line": line}],
        },
        height=380,
        time=False,
    )


def _ratios(data: Data, index: int, variant: str) -> Trace:
    rows = [row for row in data["ablation"] if row["variant"] == variant]
    known = [row for row in rows if (row["against_first"].get("tilt_rms_deg") or {}).get("ratio")]
    ratios = [row["against_first"]["tilt_rms_deg"]["ratio"] for row in known]
    return {
        "type": "scatter",
        "mode": "markers",
        "name": variant,
        "x": [ratio["value"] for ratio in ratios],
        "y": [data["cases"][row["case"]] for row in known],
        "marker": {"color": _colour(index), "size": 9},
        "error_x": {
            "type": "data",
            "symmetric": False,
            "array": [ratio["high"] - ratio["value"] for ratio in ratios],
            "arrayminus": [ratio["value"] - ratio["low"] for ratio in ratios],
            "color": _colour(index),
        },
        "hovertemplate": "%{x:.2f}",
    }


def push_panel(pushes: Mapping[str, Sequence[Data]], search: Data) -> Panel:
    """Polar picture of the largest push that is survived: median robot, and the weakest.

    Args:
        pushes: controller to limits by direction (``direction_deg, median_ns, least_ns``).
        search: how they were looked for.
    """
    lines = (("median", "median_ns", "solid"), ("weakest", "least_ns", "dot"))
    return Panel(
        key="pushes",
        title="Largest push survived",
        caption=f"0.1 s on the trunk, trot at {1e3 * search['speed']:.0f} mm/s, {search['seeds']} robots "
        "pushed at different parts of the cycle; by the direction that the push points to.",
        data=[
            _push_line(f"{controller}, {name} robot", limits, key, {"color": _colour(index), "dash": dash})
            for index, (controller, limits) in enumerate(pushes.items())
            for name, key, dash in lines
        ],
        layout={"polar": _POLAR, "hovermode": "closest", "margin": {"l": 40, "r": 40}},
        height=460,
        time=False,
    )


def _push_line(name: str, limits: Sequence[Data], key: str, line: Data) -> Trace:
    closed = [*limits, limits[0]]
    return {
        "type": "scatterpolar",
        "mode": "lines+markers",
        "name": name,
        "theta": [limit["direction_deg"] for limit in closed],
        "r": [limit[key] for limit in closed],
        "line": line,
        "marker": {"size": 5},
        "hovertemplate": "%{r:.2f} N·s to %{theta:.0f}°",
    }


def timing_panel(index: int, name: str, columns: Mapping[str, Mapping[str, Data]]) -> Panel:
    """Median time of every layer of the control tick, stacked, one bar per variant."""
    layers = dict.fromkeys(layer for timing in columns.values() for layer in timing)
    traces: list[Trace] = [
        {
            "type": "bar",
            "orientation": "h",
            "name": layer,
            "y": list(columns),
            "x": [(timing.get(layer) or {}).get("p50") for timing in columns.values()],
            "hovertemplate": "%{x:.0f} µs",
        }
        for layer in layers
        if layer not in (*_TOTALS, *_SIMULATION)
    ]
    return Panel(
        key=f"timing-{index}",
        title=f"Where the tick goes: {name}",
        caption="Median time of every layer of the control tick; its 99th percentile is in the table.",
        data=traces,
        layout={
            "barmode": "stack",
            "xaxis": {"title": {"text": "µs per tick"}},
            "yaxis": {"autorange": "reversed"},
            "hovermode": "closest",
        },
        height=340,
        time=False,
    )


def _colour(index: int) -> str:
    return COLOURS[index % len(COLOURS)]


def _headline(data: Data, missed: Sequence[Data]) -> str:
    if not data["criteria"]:
        return "Measured, nothing judged"
    if missed:
        return f"{len(missed)} of {len(data['criteria'])} limits missed"
    return f"All {len(data['criteria'])} limits hold"


def _facts(data: Data) -> list[tuple[str, str]]:
    return [("parts", ", ".join(data["parts"])), ("seeds", str(data["seeds"])), ("source", data["source"])]


def _cells(row: Data, cases: Mapping[str, str]) -> list[str]:
    figures = row["figures"]
    tilt = (row["against_first"].get("tilt_rms_deg") or {}).get("ratio")
    return [
        cases[row["case"]],
        row["variant"],
        f"{row['falls']} of {row['runs']}",
        *(_spread(figures[name], "max") for name in ("roll_rms_deg", "pitch_rms_deg")),
        "" if tilt is None else f"{tilt['value']:.2f} [{tilt['low']:.2f}, {tilt['high']:.2f}]",
        _spread(figures["clearance_mm"], "min"),
        _spread(figures["speed_mmps"], "min"),
        _spread(figures["zmp_inside_percent"], "min"),
        _spread(figures["plan_margin_mm"], "min"),
        _spread(figures["attitude_error_deg"], "max"),
    ]


def layers_in_order(columns: Mapping[str, Mapping[str, Data]]) -> list[str]:
    """Names of all layers, those that sum up or stand outside the tick last."""
    names = dict.fromkeys(layer for timing in columns.values() for layer in timing)
    last = ("rest of the tick", _TOTALS[0], *_SIMULATION, _TOTALS[1])
    return [name for name in names if name not in last] + [name for name in last if name in names]


def _timing_table(name: str, columns: Mapping[str, Mapping[str, Data]]) -> dict[str, Any]:
    rows = []
    for layer in layers_in_order(columns):
        found = (timing.get(layer) for timing in columns.values())
        rows.append([layer, *("–" if t is None else f"{t['p50']:.0f} ({t['p99']:.0f})" for t in found)])
    return {"name": name, "head": ["layer", *columns], "rows": rows}


def _spread(found: Mapping[str, float] | None, worst: str) -> str:
    return "–" if found is None else f"{found['median']:.2f} ({found[worst]:.2f})"


def _plotly_script() -> str:
    from plotly.offline import get_plotlyjs  # noqa: PLC0415 - half a second that only a page needs

    return str(get_plotlyjs())
