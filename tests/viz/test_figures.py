from __future__ import annotations

from pathlib import Path

import numpy as np

from bluefoot_mpc.gait.figures import FootfallPattern
from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.viz.figures import footfall_figure, write_figures, write_trunk_figure
from bluefoot_mpc.viz.style import LEG_COLOURS, figure_style

PNG = b"\x89PNG"


def test_gait_figures_are_written(robot: RobotModel, tmp_path: Path) -> None:
    written = write_figures(robot, tmp_path / "new", formats=("png",))
    assert [path.name for path in written] == [
        "cpg-trot.png",
        "cpg-walk.png",
        "cpg-transition.png",
        "footfall.png",
    ]
    for path in written:
        content = path.read_bytes()
        assert content.startswith(PNG)
        assert len(content) > 20_000


def test_trunk_figure_with_and_without_truth(
    robot: RobotModel, run: RunData, hardware_run: RunData, tmp_path: Path
) -> None:
    for name, data in (("sim", run), ("hardware", hardware_run)):
        (path,) = write_trunk_figure(data, robot, tmp_path / name, start=2.0, duration=1.5, formats=("svg",))
        assert path.read_text(encoding="utf-8").count("<path") > 20


def test_bars_stand_where_the_feet_stand(tmp_path: Path) -> None:
    time = np.arange(10) * 0.1
    stance = np.ones((10, 4), dtype=bool)
    stance[3:5, 0] = False
    pattern = FootfallPattern(
        gait="trot", speed=0.04, time=time, stance=stance, cycle_time=1.0, duty=stance.mean(axis=0)
    )
    with figure_style():
        figure = footfall_figure([pattern])
    bars = [collection.get_paths() for collection in figure.axes[0].collections]
    assert [len(paths) for paths in bars] == [2, 1, 1, 1]
    np.testing.assert_allclose(bars[0][1].get_extents().x0, 0.5)


def test_equal_data_gives_equal_files(robot: RobotModel, run: RunData, tmp_path: Path) -> None:
    files = [
        write_trunk_figure(run, robot, tmp_path / name, start=2.0, duration=1.0, formats=("svg",))[
            0
        ].read_bytes()
        for name in "ab"
    ]
    assert files[0] == files[1]


def test_legs_have_different_colours() -> None:
    assert len(set(LEG_COLOURS.values())) == 4
