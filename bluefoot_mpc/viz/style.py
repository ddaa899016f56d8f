"""One look for every picture: colours that colour-blind readers can tell apart, and matplotlib settings.

The hues are those of Okabe and Ito's universal palette, lightened or darkened a
little so that each keeps its contrast on white and on near-black paper.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from bluefoot_mpc.types import LEG_JOINTS, LEGS

LEG_COLOURS: dict[str, str] = {"FL": "#1283d2", "FR": "#e07020", "RL": "#12a17c", "RR": "#c05a9c"}
"""One colour per leg, the same in every plot, table and 3D scene."""

JOINT_COLOURS: dict[str, str] = {
    "hip_yaw": "#8a94a6",
    "hip_pitch": "#1283d2",
    "knee": "#e07020",
    "ankle": "#12a17c",
}

JOINT_DASHES: dict[str, str] = {"hip_yaw": "dot", "hip_pitch": "solid", "knee": "dash", "ankle": "dashdot"}

LEG_NAMES: dict[str, str] = {"FL": "front left", "FR": "front right", "RL": "rear left", "RR": "rear right"}

GUIDED_COLOURS: dict[str, str] = {
    "field": "#1283d2",
    "marker": "#c05a9c",
    "waypoint": "#6b5bd2",
    "search": "#d99a00",
    "escape": "#d1495b",
    "arrived": "#12a17c",
    "blind": "#8a94a6",
}
"""One colour for each thing that leads the robot on its own way, the same in map, bands and events."""

GUIDED_NAMES: dict[str, str] = {
    "field": "potential field",
    "marker": "marker",
    "waypoint": "waypoint",
    "search": "search",
    "escape": "way out",
    "arrived": "arrived",
    "blind": "blind",
}

PHASE_COLOURS: dict[str, str] = {
    "sweep": "#6b5bd2",
    "think": "#d99a00",
    "walk": "#1283d2",
    "arrived": "#12a17c",
    "blocked": "#d1495b",
}
"""One colour for each phase of crossing rough ground."""

PHASE_NAMES: dict[str, str] = {
    "sweep": "sweep",
    "think": "think",
    "walk": "walk",
    "arrived": "arrived",
    "blocked": "blocked",
}

GOOD = "#12a17c"
WARNING = "#d99a00"
BAD = "#d1495b"
NEUTRAL = "#8a94a6"

TRUTH = "#20262e"
"""Truth on white paper; on dark paper the page turns it light."""

ESTIMATE = "#1283d2"
COMMAND = "#e07020"
ZMP = "#d1495b"
COM = "#6b5bd2"
SUPPORT = "#12a17c"
ROUTE = "#e61a8c"
"""A planned way over rough ground, where no marker is."""
LEADER = "#8a6d1f"
MARKER = "#e61a8c"
"""The marker's own colour, which no leg wears."""

_FONTS = ["Inter", "Source Sans 3", "Helvetica Neue", "Arial", "Liberation Sans", "DejaVu Sans"]

# Typed Any: matplotlib's own type lists every key and differs between versions.
_SETTINGS: Any = {
    "figure.dpi": 110,
    "savefig.dpi": 160,
    "savefig.bbox": "tight",
    "figure.facecolor": "white",
    "figure.constrained_layout.use": True,
    "font.family": "sans-serif",
    "font.sans-serif": _FONTS,
    "font.size": 9.5,
    "axes.titlesize": 10.5,
    "axes.titleweight": "semibold",
    "axes.titlelocation": "left",
    "axes.labelsize": 9.5,
    "axes.labelcolor": "#4a5464",
    "axes.edgecolor": "#aab2bf",
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#e4e8ee",
    "grid.linewidth": 0.7,
    "xtick.color": "#6b7482",
    "ytick.color": "#6b7482",
    "xtick.labelsize": 8.5,
    "ytick.labelsize": 8.5,
    "lines.linewidth": 1.5,
    "lines.solid_capstyle": "round",
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "svg.hashsalt": "bluefoot",  # equal input gives an equal file
}


@contextmanager
def figure_style() -> Iterator[None]:
    """Draw matplotlib figures in the house style inside a ``with`` block."""
    import logging  # noqa: PLC0415

    import matplotlib as mpl  # noqa: PLC0415

    # Fonts early in the list are optional; matplotlib warns about each one it cannot find.
    finder = logging.getLogger("matplotlib.font_manager")
    level = finder.level
    finder.setLevel(logging.ERROR)
    try:
        with mpl.rc_context(_SETTINGS):
            yield
    finally:
        finder.setLevel(level)


def leg_colour(index: int) -> str:
    """Colour of leg `index` in the house order FL, FR, RL, RR."""
    return LEG_COLOURS[LEGS[index]]


def joint_colour(index: int) -> str:
    """Colour of joint `index` (0..15, leg-major) by its place in the leg."""
    return JOINT_COLOURS[LEG_JOINTS[index % len(LEG_JOINTS)]]
