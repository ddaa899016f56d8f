"""The scenario sweep, in one short run with few levels, on a robot whose LIDAR is mounted askew."""

import numpy as np
import pytest

from bluefoot_mpc.runtime.clouds import run_cloud
from bluefoot_mpc.scenarios import RunOptions
from bluefoot_mpc.scenarios.config import resolve
from bluefoot_mpc.scenarios.folder import CLOUD, keep_cloud
from bluefoot_mpc.scenarios.registry import find_scenario
from bluefoot_mpc.scenarios.runner import simulate
from bluefoot_mpc.scenarios.sweep_figures import OTHERWISE
from bluefoot_mpc.terrain.cloud_files import read_cloud
from bluefoot_mpc.types import GuideTask, Mode

ASKEW = (0.7, 1.0, 0.0)


@pytest.fixture(scope="module")
def swept():
    overrides = (
        "scenario.duration=4.4", "scenario.stand_time=0.4", f"sim.lidar.mount_error_deg={list(ASKEW)}",
        "control.crossing.first_sweep.pitch_max_deg=22", "control.crossing.first_sweep.ground_step=0.05",
        "control.crossing.first_sweep.max_rate=1.0", "control.crossing.think_ticks=5",
        "control.crossing.first_sweep.dwell_scans=1",
    )  # fmt: skip
    return simulate("sweep", RunOptions(world="flat", seed=1, controller="cpg", overrides=overrides))


def test_the_sweep_comes_after_the_standing_and_brings_rubble_and_a_lidar():
    made = resolve(find_scenario("sweep"), RunOptions())
    assert (made.stages.sim.world.name, made.stages.sim.lidar.enabled) == ("rubble", True)
    assert made.scenario.command(0.5).mode is Mode.STAND
    command = made.scenario.command(2.0)
    assert (command.mode, command.guide.task) == (Mode.WALK, GuideTask.SWEEP)


def test_every_level_is_reached_feet_planted(swept):
    figures = swept.summary["figures"]
    assert (figures["levels"], figures["sweeps"], figures["sweep_reason"]) == (14, 1, None)
    assert figures["points"] > 2000
    assert not swept.summary["fell"]
    feet = np.array([sample.foot_position[:, :2] for sample in swept.data.truth])
    assert np.abs(feet - feet[0]).max() < 0.005


def test_the_mounting_of_the_lidar_is_found_and_said(swept):
    figures = swept.summary["figures"]
    np.testing.assert_allclose(figures["lidar_rpy_deg"][:2], ASKEW[:2], atol=0.15)
    assert figures["lidar_mounting"] == OTHERWISE
    told = [c for c in swept.criteria if "LIDAR mounted" in c.name]
    assert [c.holds for c in told] == [False]
    assert "lidar_rpy_deg = [" in told[0].detail


def test_a_lidar_that_is_askew_spoils_the_map(swept):
    figures = swept.summary["figures"]
    assert figures["map_error_median_mm"] > 5.0
    assert not swept.success


def test_the_cloud_of_a_run_has_the_time_stamps_of_its_scans(swept, tmp_path):
    data = swept.data
    cloud = run_cloud(data.telemetry, data.frames)
    assert len(cloud.time) == swept.summary["figures"]["points"]
    scans = {frame.lidar.time for frame in data.frames if frame.lidar is not None}
    assert set(cloud.time.tolist()) <= scans
    np.testing.assert_array_equal(run_cloud(data.telemetry).points, cloud.points)
    keep_cloud(data, tmp_path / CLOUD)
    kept = read_cloud(tmp_path / CLOUD)
    np.testing.assert_array_equal(kept.time, cloud.time)
    np.testing.assert_allclose(kept.points, cloud.points, atol=1e-6)


def test_a_run_that_looked_at_nothing_leaves_no_cloud(swept, tmp_path):
    assert not len(run_cloud(()).time)
    keep_cloud(type(swept.data)(telemetry=swept.data.telemetry[:10]), tmp_path / CLOUD)
    assert not (tmp_path / CLOUD).exists()
