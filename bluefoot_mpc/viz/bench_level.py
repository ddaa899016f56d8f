"""The bench's figures and table of trunk levelling: what each part gives, and what the network is worth."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from bluefoot_mpc.viz.plots import Panel, Trace
from bluefoot_mpc.viz.style import COM, COMMAND, ESTIMATE, GOOD, NEUTRAL, ZMP

Data = Mapping[str, Any]

LEVEL_HEAD = (
    "part", "falls", "roll °", "roll %", "pitch °", "pitch %", "over pd", "over persistence", "network",
    "tilt % by window", "peak °", "mm/s", "height mm", "let go",
)  # fmt: skip
"""Titles of the cells that `level_cells` gives; what has an arrow is without → with levelling."""
_COLOURS = {
    "mix": NEUTRAL, "pd": ESTIMATE, "narx": COMMAND, "network": ZMP, "persistence": GOOD, "model": COM,
}  # fmt: skip
_FEW = 6
"""Cases whose titles need no room to slant."""
_TILT = "on_tilt_rms_deg"
_DASH = "–"


def level_panels(level: Data) -> list[Panel]:
    """Every figure that the data allow.

    Args:
        level: part ``level`` of a bench.
    """
    panels = [reduction_panel(level, axis) for axis in ("roll", "pitch")]
    return [*panels, credit_panel(level)] if level["credits"] else panels


def reduction_panel(level: Data, axis: str) -> Panel:
    """Bars of the median reduction of every part in every case, whiskers from the worst to the best seed."""
    return Panel(
        key=f"level-{axis}",
        title=f"Levelling: reduction of {axis}",
        caption=f"RMS of {axis} in the windows with levelling against those without, of the same run. Bar: "
        "median seed, whisker: worst to best. Below zero it tilts more.",
        data=[_bars(level, part, f"{axis}_reduction_percent") for part in level["parts"]],
        layout={
            "barmode": "group",
            "yaxis": {"title": {"text": "% less RMS"}, "zeroline": True},
            "xaxis": {"automargin": True},
        },
        height=400 if len(level["cases"]) <= _FEW else 520,
        wide=True,
        time=False,
    )


def _bars(level: Data, part: str, figure: str) -> Trace:
    rows = [row for row in level["rows"] if row["part"] == part]
    found = [row["figures"][figure] for row in rows]
    return {
        "type": "bar",
        "name": part,
        "x": [level["cases"][row["case"]] for row in rows],
        **medians(found),
        "marker": {"color": _COLOURS.get(part, NEUTRAL)},
        "hovertemplate": "%{y:.1f} %",
    }


def medians(found: Sequence[Mapping[str, float] | None]) -> Trace:
    """Part of a trace: medians of a figure over the seeds, with whiskers to the least and the greatest.

    Args:
        found: median, min and max of every bar; None where they are unknown.
    """
    return {
        "y": [None if f is None else f["median"] for f in found],
        "error_y": {
            "type": "data",
            "symmetric": False,
            "array": [None if f is None else f["max"] - f["median"] for f in found],
            "arrayminus": [None if f is None else f["median"] - f["min"] for f in found],
            "thickness": 1.2,
            "width": 2,
            "color": "@ink",
        },
    }


def credit_panel(level: Data) -> Panel:
    """Tilt with the network over the tilt with feedback alone and with persistence, case by case."""
    lines = (("over pd", "pd", ESTIMATE, "circle"), ("over persistence", "persistence", GOOD, "diamond"))
    shapes = [
        _upright(1.0, {"color": NEUTRAL, "width": 1.2}),
        _upright(1.0 - level["least_gain"], {"color": GOOD, "width": 1.2, "dash": "dot"}),
    ]
    return Panel(
        key="level-credit",
        title="Is the network worth having?",
        caption=f"Tilt with feedback and network over that of the two it has to beat, with bootstrap 95 % "
        f"interval over the seeds; left of the full line it tilts less. {credit_line(level)}",
        data=[_ratios(level, *line) for line in lines],
        layout={
            "hovermode": "closest",
            "xaxis": {"title": {"text": "ratio of tilt RMS in the windows with levelling"}},
            "yaxis": {"autorange": "reversed", "automargin": True},
            "shapes": shapes,
        },
        height=160 + 34 * len(level["credits"]),
        wide=True,
        time=False,
    )


def credit_line(level: Data) -> str:
    """One sentence: where the network beats feedback and persistence clearly."""
    earned = [level["cases"][credit["case"]] for credit in level["credits"] if credit["credited"]]
    which = f": {'; '.join(earned)}" if earned else ""
    return (
        f"With the network the trunk tilts at least {100.0 * level['least_gain']:.0f} % less than with "
        f"feedback alone and than with persistence in {len(earned)} of {len(level['credits'])} cases{which}."
    )


def _upright(x: float, line: Data) -> dict[str, Any]:
    return {"type": "line", "yref": "paper", "x0": x, "x1": x, "y0": 0, "y1": 1, "line": line}


def _ratios(level: Data, name: str, other: str, colour: str, symbol: str) -> Trace:
    known = [credit for credit in level["credits"] if credit["against"][other]["ratio"]]
    ratios = [credit["against"][other]["ratio"] for credit in known]
    return {
        "type": "scatter",
        "mode": "markers",
        "name": name,
        "x": [ratio["value"] for ratio in ratios],
        "y": [level["cases"][credit["case"]] for credit in known],
        "marker": {"color": colour, "size": 9, "symbol": symbol},
        "error_x": {
            "type": "data",
            "symmetric": False,
            "array": [ratio["high"] - ratio["value"] for ratio in ratios],
            "arrayminus": [ratio["value"] - ratio["low"] for ratio in ratios],
            "color": colour,
        },
        "hovertemplate": "%{x:.2f}",
    }


def level_cells(row: Data, credits_: Sequence[Data]) -> list[str]:
    """A row of the table, in the order of `LEVEL_HEAD`.

    Args:
        row: a part in a case.
        credits_: whether the network earned its place, case by case.
    """
    f, against = row["figures"], row["against"]
    return [
        row["part"],
        f"{row['falls']} of {row['runs']}",
        off_on(f, "roll_rms_deg", 2),
        lower(f["roll_reduction_percent"]),
        off_on(f, "pitch_rms_deg", 2),
        lower(f["pitch_reduction_percent"]),
        ratio_text(against.get("pd")),
        ratio_text(against.get("persistence")),
        credit_of(row, credits_),
        by_window(f),
        off_on(f, "tilt_peak_deg", 1),
        off_on(f, "speed_mmps", 1),
        _DASH if f["height_change_mm"] is None else f"{f['height_change_mm']['median']:+.1f}",
        str(row["disengaged"]),
    ]


def level_table(level: Data) -> dict[str, Any]:
    """Head, rows by case, and the network's verdict; empty without the part.

    Args:
        level: part ``level`` of a bench.
    """
    if not level:
        return {}
    groups = [
        (title, [level_cells(row, level["credits"]) for row in level["rows"] if row["case"] == name])
        for name, title in level["cases"].items()
    ]
    return {
        "head": LEVEL_HEAD,
        "groups": [(title, rows) for title, rows in groups if rows],
        "credit": credit_line(level) if level["credits"] else "",
    }


def lower(found: Mapping[str, float] | None) -> str:
    """Change in percent: the median seed, and the seeds that are best and worst."""
    if found is None:
        return _DASH
    return f"{-found['median']:+.0f} ({-found['max']:+.0f}…{-found['min']:+.0f})"


def by_window(figures: Mapping[str, Data | None]) -> str:
    """Median change of the tilt, percent, in the first, second and third window with levelling."""
    found = [figures[f"tilt_reduction_{number}_percent"] for number in (1, 2, 3)]
    return " ".join(_DASH if seen is None else f"{-seen['median']:+.0f}" for seen in found)


def off_on(figures: Mapping[str, Data | None], name: str, digits: int) -> str:
    """Medians of a figure without and with levelling."""
    off, on = figures[f"off_{name}"], figures[f"on_{name}"]
    if off is None or on is None:
        return _DASH
    return f"{off['median']:.{digits}f} → {on['median']:.{digits}f}"


def ratio_text(against: Data | None) -> str:
    """Ratio of the tilts to another row's, with its interval; empty without that row."""
    if against is None:
        return ""
    found = against[_TILT]
    if found["ratio"] is None:
        return f"{_DASH} ({found['pairs']} pairs)"
    return "{value:.2f} [{low:.2f}, {high:.2f}]".format(**found["ratio"])


def credit_of(row: Data, credits_: Sequence[Data]) -> str:
    """Whether the network earned its place in a row's case; empty where that is not judged."""
    judged = [credit for credit in credits_ if credit["case"] == row["case"]]
    if row["part"] != "narx" or not judged:
        return ""
    return str(judged[0]["verdict"])
