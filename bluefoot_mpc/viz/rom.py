"""Pictures of the range-of-motion study: where the trunk can go, and how far it can tilt."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.model.rom import PAPER_SHIFT_FIXED, PAPER_TILT_DEG, RomMap, RomStudy
from bluefoot_mpc.types import FloatArray
from bluefoot_mpc.viz.style import COMMAND, ESTIMATE, NEUTRAL, TRUTH, figure_style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_LEVEL_STEP = 5.0  # degrees between the colours of the margin
_GROW = 4  # cells that the colours run on past the edge, where the outline cuts them


@dataclass(frozen=True, kw_only=True, slots=True)
class _Panel:
    """What differs between the two pictures."""

    file: str
    title: str
    labels: tuple[str, str]
    scale: float  # from m or rad to the unit shown
    unit: str
    paper: float  # the paper's reach along the axes, in the unit shown
    paper_ankle: str  # and the ankle policy that it is stated for


_SHIFT = _Panel(
    file="rom_translation.png",
    title="Trunk translation over planted feet",
    labels=("x, forward (cm)", "y, left (cm)"),
    scale=100.0,
    unit=" cm",
    paper=100.0 * PAPER_SHIFT_FIXED,
    paper_ankle="fixed",
)
_TILT = _Panel(
    file="rom_tilt.png",
    title="Trunk tilt over planted feet",
    labels=("roll, right side down (°)", "pitch, nose down (°)"),
    scale=float(np.degrees(1.0)),
    unit="°",
    paper=PAPER_TILT_DEG,
    paper_ankle="free",
)


def save_rom_pictures(study: RomStudy, folder: Path) -> list[Path]:
    """Draw the feasible translations and tilts with both ankle policies.

    Args:
        study: result of `bluefoot_mpc.model.rom.study_range_of_motion`.
        folder: where the PNG files go; made if it is missing.

    Returns:
        The files: ``rom_translation.png`` and ``rom_tilt.png``.

    Raises:
        ConfigurationError: the folder cannot be written.
    """
    from matplotlib.figure import Figure  # noqa: PLC0415

    files = []
    pictures = ((_SHIFT, study.shift_free, study.shift_fixed), (_TILT, study.tilt_free, study.tilt_fixed))
    with figure_style():
        for panel, free, fixed in pictures:
            figure = Figure(figsize=(6.8, 5.4))
            _draw(figure, panel, free, fixed, study)
            file = folder / panel.file
            try:
                folder.mkdir(parents=True, exist_ok=True)
                figure.savefig(file)
            except OSError as error:
                raise ConfigurationError(f"cannot write {file}: {error.strerror or error}") from error
            files.append(file)
    return files


def _draw(figure: Figure, panel: _Panel, free: RomMap, fixed: RomMap, study: RomStudy) -> None:
    axes = figure.add_subplot()
    gamma = f"{np.degrees(study.ankle_direction):.0f}°".replace("-", "−")
    _fill_margin(figure, axes, panel, free)
    _outline(axes, panel, free, ESTIMATE, "ankle direction free")
    _outline(axes, panel, fixed, COMMAND, f"ankle direction fixed at {gamma}")
    axes.plot(0.0, 0.0, "+", color=TRUTH, markersize=9, label="default stance")
    _mark_paper(axes, panel)
    half = 1.12 * float(np.abs(panel.scale * free.boundary).max())
    axes.set(xlim=(-half, half), ylim=(-half, half), xlabel=panel.labels[0], ylabel=panel.labels[1])
    axes.set_aspect("equal")
    axes.set_title(panel.title, pad=20.0)
    subtitle = f"{study.robot}, trunk {1e3 * study.trunk_height:.0f} mm above the feet, imposed joint limits"
    axes.text(0.0, 1.02, subtitle, transform=axes.transAxes, fontsize=8.5, color=NEUTRAL)
    figure.legend(loc="outside lower center", ncols=2)


def _fill_margin(figure: Figure, axes: Axes, panel: _Panel, free: RomMap) -> None:
    """Colour the feasible region by the distance to the nearest joint limit."""
    from matplotlib.patches import Polygon  # noqa: PLC0415

    margin = np.degrees(_grown(free.margin))
    top = _LEVEL_STEP * np.ceil(max(float(margin[np.isfinite(margin)].max()), 1.0) / _LEVEL_STEP)
    levels = np.arange(0.0, top + 0.5 * _LEVEL_STEP, _LEVEL_STEP)
    values = np.clip(np.where(np.isfinite(margin), margin, 0.0), 0.0, top)
    filled = axes.contourf(
        panel.scale * free.first, panel.scale * free.second, values.T, levels=levels, cmap="Blues", alpha=0.75
    )
    filled.set_clip_path(Polygon(panel.scale * free.boundary, transform=axes.transData))
    bar = figure.colorbar(filled, ax=axes, shrink=0.85)
    bar.set_label("nearest joint limit, ankle direction free (°)")


def _outline(axes: Axes, panel: _Panel, region: RomMap, colour: str, label: str) -> None:
    closed = panel.scale * np.vstack([region.boundary, region.boundary[:1]])
    reach = f"±{panel.scale * region.extent:.1f}{panel.unit} along the axes"
    axes.plot(*closed.T, color=colour, linewidth=2.0, label=f"{label}: {reach}")


def _mark_paper(axes: Axes, panel: _Panel) -> None:
    """Mark the paper's figure by diamonds on the axes."""
    points = panel.paper * np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
    label = f"paper, {panel.paper_ankle}: ±{panel.paper:g}{panel.unit}"
    axes.plot(*points.T, "D", color="white", markeredgecolor=TRUTH, markersize=5.5, label=label, zorder=4)
    axes.axhline(0.0, color=NEUTRAL, linewidth=0.6, zorder=1.5)
    axes.axvline(0.0, color=NEUTRAL, linewidth=0.6, zorder=1.5)


def _grown(margin: FloatArray) -> FloatArray:
    """The map with its last finite values carried a few cells outwards, so that colours reach the edge."""
    grown = margin.copy()
    for _ in range(_GROW):
        padded = np.pad(grown, 1, constant_values=-np.inf)
        around = np.maximum.reduce([padded[:-2, 1:-1], padded[2:, 1:-1], padded[1:-1, :-2], padded[1:-1, 2:]])
        grown = np.where(np.isfinite(grown), grown, around)
    return grown
