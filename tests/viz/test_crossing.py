"""The report of a run over rough ground."""

from __future__ import annotations

import base64
import dataclasses
import json
import math
import re
from typing import Any

import numpy as np
import plotly.graph_objects as go
import pytest

from bluefoot_mpc.geometry import rotation_z
from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.sim.worlds.heights import heights
from bluefoot_mpc.terrain.cost import CostConfig, cost_tensor, yaw_index
from bluefoot_mpc.terrain.plan_config import PlanConfig
from bluefoot_mpc.types import HeightMap
from bluefoot_mpc.viz.crossing import Crossing, crossing_of
from bluefoot_mpc.viz.crossing_series import MapAt
from bluefoot_mpc.viz.journey import journey_of
from bluefoot_mpc.viz.plots import Panel
from bluefoot_mpc.viz.plots_cost import ASIDE, cost_config
from bluefoot_mpc.viz.plots_terrain import some_maps
from bluefoot_mpc.viz.rasters import raster_of
from bluefoot_mpc.viz.replay import replay_html
from bluefoot_mpc.viz.report import report_html
from bluefoot_mpc.viz.scans import known_plan
from bluefoot_mpc.viz.series import extract
from bluefoot_mpc.viz.verdict_crossing import crossing_events, crossing_tiles

from . import crossing_run as made
from .crossing_run import crossing_run
from .html_check import read_page
from .synthetic_run import make_summary
from .test_journey import numbers

PANELS = ["ground", "map-quality", "cloud", "crossing", "side", "cost"]
FIGURES = {
    "goal_left_m": 0.012, "reached_s": 11.0, "sweeps": 2, "map_error_median_mm": 1.4, "map_error_95_mm": None,
}  # fmt: skip


def crossing(run: RunData, robot: RobotModel) -> Crossing:
    found = crossing_of(run, extract(run, 1.5), robot)
    assert found is not None
    return found


@pytest.fixture(scope="module")
def rough_run(robot: RobotModel) -> RunData:
    return crossing_run(robot)


@pytest.fixture(scope="module")
def shown(rough_run: RunData, robot: RobotModel) -> Crossing:
    return crossing(rough_run, robot)


@pytest.fixture(scope="module")
def panels(shown: Crossing) -> dict[str, Panel]:
    return {panel.key: panel for panel in shown.panels}


@pytest.fixture(scope="module")
def html(rough_run: RunData, robot: RobotModel) -> str:
    return report_html(rough_run, make_summary(scenario="rough", figures=FIGURES), robot)


def named(panel: Panel, name: str) -> dict[str, Any]:
    data = panel.steps[-1].data if panel.steps else panel.data
    (trace,) = [trace for trace in data if trace.get("name") == name]
    return trace


def maps_of(run: RunData) -> list[tuple[int, HeightMap]]:
    reports = [(k, record.crossing) for k, record in enumerate(run.telemetry)]
    return [(k, r.ground) for k, r in reports if r is not None and r.ground is not None]


def test_figures_come_in_order_and_only_for_runs_that_cross(
    shown: Crossing, rough_run: RunData, run: RunData, guided_run: RunData, robot: RobotModel
) -> None:
    assert [panel.key for panel in shown.panels] == PANELS
    for other in (run, guided_run):
        assert crossing_of(other, extract(other, 1.5), robot) is None
    # Its sweeps look down: no map of what stands around is made of them.
    assert journey_of(rough_run, extract(rough_run, 1.5), robot) is None


def test_each_sweep_has_its_map_in_place(panels: dict[str, Panel], rough_run: RunData) -> None:
    steps = panels["ground"].steps
    found = maps_of(rough_run)
    assert [step.time for step in steps] == pytest.approx([rough_run.telemetry[k].time for k, _ in found])
    for step, (_, ground) in zip(steps, found, strict=True):
        unknown, known = step.data[:2]
        height, x, y = numbers(known["z"]), numbers(known["x"]), numbers(known["y"])
        # Heights count from the ground at the start, whatever the estimate's zero is.
        expected = 1e3 * (ground.height + ground.pose[2] + made.RADIUS)
        first = (np.argmin(np.abs(y - ground.pose[1] - 0.01)), np.argmin(np.abs(x - ground.pose[0] - 0.01)))
        own = height[first[0] : first[0] + 50, first[1] : first[1] + 70]
        there = np.isfinite(expected)
        assert own[there] == pytest.approx(expected[there], abs=1e-2)
        hidden = np.frombuffer(base64.b64decode(unknown["z"]["bdata"]), "i1").reshape(height.shape)
        assert (hidden == np.isnan(height)).all()
    # The older map shows where the newest ends.
    assert np.isfinite(height).sum() > there.sum() + 500
    assert np.isnan(own[~there]).any()


def test_a_turned_map_is_laid_into_the_odometry_frame() -> None:
    height = np.arange(12.0).reshape(3, 4)
    pose = np.array([1.0, 2.0, 0.0, math.pi / 2])
    ground = HeightMap(time=0.0, cell=0.1, pose=pose, height=height, confidence=np.ones((3, 4)))
    raster = raster_of(ground)
    values = raster.show(height)
    # Forward in the map is left in the odometry frame, left is backward.
    at = np.unravel_index(np.nanargmax(values), values.shape)
    assert (raster.x[at[1]], raster.y[at[0]]) == pytest.approx((0.75, 2.35), abs=0.051)
    assert (raster.x.min(), raster.y.min()) == pytest.approx((0.725, 2.025))
    assert sorted(set(values[np.isfinite(values)].tolist())) == height.ravel().tolist()


def test_chosen_footholds_and_landings(panels: dict[str, Panel], shown: Crossing, rough_run: RunData) -> None:
    swings = shown.series.swings
    assert len(swings) > 30
    for swing in swings:
        foot = rough_run.truth[swing.landed].foot_position[swing.leg]
        assert swing.landing[2] == pytest.approx(foot[2] - made.RADIUS, abs=1e-9)
        if not math.isfinite(swing.missed):
            continue
        chosen = [t.crossing.footholds[swing.leg] for t in rough_run.telemetry if t.crossing is not None]
        wanted = swing.chosen - [0, 0, made.RADIUS]
        assert np.nanmin(np.abs(np.array(chosen) - wanted).max(axis=1)) < 1e-9
        assert swing.missed == pytest.approx(0.006, abs=0.004)
    rings, discs = (numbers(named(panels["ground"], name)["x"]) for name in ("FL foothold", "FL"))
    landed = [swing.landing[0] for swing in swings if swing.leg == 0]
    assert discs == pytest.approx(np.array(landed), abs=1e-6)
    assert len(rings) == sum(math.isfinite(swing.missed) for swing in swings if swing.leg == 0)
    assert re.search(r"discs: landings as estimated, \d+ mm apart", panels["ground"].caption)


def test_errors_are_those_of_the_robot_where_it_truly_stood(
    panels: dict[str, Panel], rough_run: RunData
) -> None:
    tick, ground = maps_of(rough_run)[-1]
    error = numbers(panels["map-quality"].steps[-1].data[1]["z"])
    # The estimate has run away to the left by the drift alone.
    y, x = np.mgrid[:50, :70]
    drift = made.DRIFT * rough_run.telemetry[tick].time
    places = ground.pose[:2] - [0.0, drift] + made.CELL * (np.stack([x, y], axis=-1) + 0.5)
    true = heights(made.rubble(), places)
    expected = 1e3 * (ground.height + ground.pose[2] + made.RADIUS - true)
    close = np.abs(error - expected) < 0.05
    # A place on an edge may fall to either side.
    assert close[np.isfinite(expected)].mean() > 0.99
    assert np.isnan(error[np.isnan(expected)]).all()
    assert "median 1.3 mm" in panels["map-quality"].caption


def test_what_is_believed_is_laid_where_the_robot_truly_stood(shown: Crossing) -> None:
    series, tick = shown.series, 200
    turn = series.turn.copy()
    turn[tick] = rotation_z(0.3)
    turned = dataclasses.replace(series, turn=turn)
    # What is a metre ahead of the believed robot is a metre ahead of the true one, which looks elsewhere.
    ahead = turned.in_world(series.estimate[tick] + np.array([1.0, 0.0, -0.1]), tick)
    expected = series.position[tick] + np.array([math.cos(0.3), math.sin(0.3), -0.1])
    assert ahead == pytest.approx(expected)
    assert turned.in_world(series.estimate[tick], tick) == pytest.approx(series.position[tick])


def test_the_cloud_is_the_robots_own(panels: dict[str, Panel], shown: Crossing, rough_run: RunData) -> None:
    reports = [t.crossing for t in rough_run.telemetry if t.crossing is not None]
    points = np.concatenate([r.points for r in reports]) + np.array([0, 0, made.RADIUS])
    cloud = panels["cloud"].data[0]
    drawn = np.column_stack([numbers(cloud[axis]) for axis in "xyz"])
    assert 500 < len(drawn) <= len(points) == shown.series.seen
    for row in drawn[::50]:
        assert np.abs(points - row).max(axis=1).min() < 1e-4
    assert (np.diff(shown.series.point_time) >= 0.0).all()


def test_bands_speed_pitch_and_distance(panels: dict[str, Panel], rough_run: RunData) -> None:
    panel = panels["crossing"]
    bands = {trace["name"].split(",")[0]: numbers(trace["x"]) for trace in panel.data if "x" in trace}
    walk = bands["walk"].reshape(-1, 3)[:, :2]
    assert walk == pytest.approx(np.array([[made.WALKS, made.ENDS]]), abs=0.021)
    wanted, estimate = named(panel, "wanted pitch"), [t for t in panel.data if t["name"] == "estimate"]
    assert np.nanmax(numbers(wanted["y"])) == pytest.approx(32.0, abs=0.5)
    assert np.nanmax(numbers(named(panel, "allowed speed")["y"])) == pytest.approx(30.0)
    left = numbers(estimate[1]["y"])
    way = np.array([t.estimate.position[:2] for t in rough_run.telemetry])
    assert left == pytest.approx(np.hypot(*(way - made.GOAL).T), abs=1e-6)
    titles = [axis["title"]["text"] for key, axis in panel.layout.items() if key.startswith("yaxis")]
    assert titles == ["", "pitch (°)", "speed (mm/s)", "step height (mm)", "to the goal (m)"]


def test_the_side_view_shows_ground_and_clearance(
    panels: dict[str, Panel], shown: Crossing, rough_run: RunData
) -> None:
    ground, mapped = (
        next(t for t in panels["side"].data if t["name"] == name and t["yaxis"] == "y")
        for name in ("ground", "map")
    )
    x, z = numbers(ground["x"]), numbers(ground["y"])
    feet = rough_run.stack("truth", "foot_position")[:, 0]
    under = heights(made.rubble(), np.column_stack([x, np.interp(x, feet[:, 0], feet[:, 1])]))
    assert np.mean(np.abs(z - 1e3 * under) < 0.1) > 0.97
    known = np.isfinite(numbers(mapped["y"]))
    assert 0.5 < known.mean() < 1.0
    off = np.abs(numbers(mapped["y"])[known] - np.interp(numbers(mapped["x"])[known], x, z))
    assert np.median(off) < 4.0
    least = re.search(r"least (\d+) mm", panels["side"].layout["annotations"][0]["text"])
    assert least is not None
    assert 3 <= int(least[1]) <= 18


def test_cost_cuts_are_those_of_the_tensor(panels: dict[str, Panel], rough_run: RunData) -> None:
    _, ground = maps_of(rough_run)[-1]
    config = PlanConfig().cost
    tensor = cost_tensor(ground, config)
    cuts = [trace for trace in panels["cost"].steps[-1].data if trace.get("colorscale") == "Viridis"]
    for trace, yaw in zip(cuts, (ASIDE, 0.0, -ASIDE), strict=True):
        expected = tensor[:, :, yaw_index(yaw, config.yaws)]
        cost = 10.0 ** numbers(trace["z"])
        stands = np.isfinite(expected)
        assert cost[stands] == pytest.approx(np.maximum(expected[stands], 1e-3), rel=1e-4)
        assert (np.isnan(cost) == ~stands).all()
    names = [note["text"] for note in panels["cost"].layout["annotations"]]
    assert names == ["<b>20° to the left</b>", "<b>straight on</b>", "<b>20° to the right</b>"]


def test_costs_are_the_configured_ones() -> None:
    table = {"control": {"crossing": {"plan": {"cost": {"k_yaw": 2.5}}}}}
    assert cost_config(table) == CostConfig(k_yaw=2.5)
    assert cost_config({"control": {"crossing": {"plan": {"cost": {"k_yam": 1.0}}}}}) == PlanConfig().cost
    assert cost_config({}) == PlanConfig().cost


def test_figures_and_events(shown: Crossing) -> None:
    checks = [{"name": "there", "holds": True, "detail": "", "figure": "goal_left_m", "goal": "≤ 0.05 m"}]
    tiles = {tile.label: tile for tile in crossing_tiles({"figures": FIGURES}, checks)}
    assert list(tiles) == ["Short of the goal line", "Goal line reached", "Sweeps", "Map error, median"]
    assert tiles["Short of the goal line"].status == "good"
    assert (tiles["Sweeps"].value, tiles["Map error, median"].unit) == ("2", "mm")
    events = crossing_events(shown.series)
    assert [text for _, text in events] == [
        "crossing: sweep", "crossing: think", "crossing: walk", "crossing: sweep", "crossing: think",
        "crossing: the older map moves by 4 mm onto the newest sweep", "crossing: arrived",
    ]  # fmt: skip


def test_what_touches_the_ground_is_told_and_marked(rough_run: RunData, robot: RobotModel) -> None:
    truth = list(rough_run.truth)
    for k in (*range(200, 230), *range(300, 310)):
        truth[k] = dataclasses.replace(truth[k], touching=("FL_shin",))
    found = crossing(dataclasses.replace(rough_run, truth=truth), robot)
    panel = next(panel for panel in found.panels if panel.key == "crossing")
    spans = [(shape["x0"], shape["x1"]) for shape in panel.layout["shapes"]]
    assert spans == [pytest.approx((4.0, 4.6)), pytest.approx((6.0, 6.2))]
    assert "Red: a part of the robot" in panel.caption
    told = [(round(time, 2), text) for time, text in crossing_events(found.series) if "touches" in text]
    assert told == [(4.0, "touches the ground with FL_shin"), (6.0, "touches the ground with FL_shin")]


def test_every_figure_is_valid_plotly_and_the_page_small(html: str) -> None:
    page = read_page(html)
    assert set(PANELS) <= set(page.ids)
    assert "The robot walked over the rough ground in 11 s" in html
    figures = json.loads(page.texts["figures"])
    for key in PANELS:
        for data in [step["data"] for step in figures[key].get("steps", [figures[key]])]:
            text = json.dumps({"data": data, "layout": figures[key]["layout"]})
            assert len(go.Figure(json.loads(re.sub(r'"@\w+"', '"#000000"', text))).data) > 0
    assert len(json.dumps(figures)) < 2e6


def whole(text: str) -> np.ndarray[Any, Any]:
    return np.frombuffer(base64.b64decode(text), "<i2")


def test_the_replay_has_ground_cloud_map_and_footholds(
    html: str, shown: Crossing, rough_run: RunData
) -> None:
    data = json.loads(read_page(html).texts["run-data"])
    assert data["bounds"] is None
    assert data["rough"] == {"floor": 0.0, "below": made.RADIUS}
    terrain, series = data["terrain"], shown.series
    assert whole(terrain["points"]).reshape(-1, 3) == pytest.approx(1e3 * series.points, abs=0.51)
    assert len(numbers(terrain["pointTime"])) == len(series.points)
    (_, first), _ = maps_of(rough_run)
    grid = whole(terrain["maps"][0]["heights"]).reshape(first.height.shape)
    assert terrain["maps"][0]["columns"] == first.height.shape[1]
    assert ((grid == -32768) == np.isnan(first.height)).all()
    known = np.isfinite(first.height)
    assert grid[known] == pytest.approx(1e3 * first.height[known], abs=0.51)
    aims = whole(terrain["aims"]["at"]).reshape(-1, 3)
    assert len(aims) == len(terrain["aims"]["leg"]) == len(numbers(terrain["aims"]["time"])) > 30


@pytest.mark.parametrize("world", ["ramp", "stones"])
def test_tilted_and_sunken_ground_stands_in_the_replay(robot: RobotModel, world: str) -> None:
    plan, quick = made.rubble(world), crossing_run(robot, duration=1.2, world=world)
    assert known_plan(quick, robot.parameters.sensors) == plan
    data = json.loads(read_page(replay_html(quick, robot)).texts["run-data"])
    assert data["rough"]["floor"] == plan.floor
    (things,) = [command for command in data["surroundings"] if command["path"].endswith("/things")]
    for solid, body in zip(plan.solids, things["object"]["object"]["children"], strict=True):
        matrix = np.reshape(body["matrix"], (4, 4)).T
        # The upper side of a box is where the plan's geometry says.
        top = matrix @ [0.0, 0.0, 0.5 * solid.size[2], 1.0]
        assert top[2] == pytest.approx(float(heights(plan, top[:2])), abs=1e-4)


def test_another_world_is_not_shown(rough_run: RunData, robot: RobotModel) -> None:
    other = dataclasses.replace(rough_run, config={**rough_run.config, "sim": {"world": {"name": "stones"}}})
    assert known_plan(rough_run, robot.parameters.sensors) == made.rubble()
    assert known_plan(other, robot.parameters.sensors) is None
    titles = [panel.title for panel in crossing(other, robot).panels]
    assert "Confidence of the map" in titles


def test_a_run_without_truth_has_a_report(robot: RobotModel) -> None:
    found = crossing(crossing_run(robot, duration=3.0, truth=False), robot)
    titles = {panel.key: panel.title for panel in found.panels}
    assert list(titles) == PANELS
    assert titles["map-quality"] == "Confidence of the map"


def test_a_blocked_run_says_so(robot: RobotModel) -> None:
    run = crossing_run(robot, duration=2.0, blocked=True)
    found = {panel.key: panel for panel in crossing(run, robot).panels}
    assert "map-quality" not in found
    assert "cost" not in found
    assert found["ground"].caption.startswith("No map was ever built")
    assert "Blocked at 1.0 s: no way over a gap of 90 mm." in found["crossing"].caption
    page = report_html(run, make_summary(scenario="rough", figures={}, success=False), robot)
    assert "crossing: blocked (no way over a gap of 90 mm)" in page
    read_page(page)


def test_bad_data_does_not_spoil_the_report(rough_run: RunData, robot: RobotModel) -> None:
    bad = {
        "points": np.full((5, 3), np.nan), "footholds": np.full((4, 3), np.inf),
        "route": np.full((3, 3), np.nan), "lift": np.full(4, np.nan), "speed": math.nan,
        "drift": math.nan, "pitch": math.nan,
    }  # fmt: skip
    (_, good), _ = maps_of(rough_run)
    grounds = [
        dataclasses.replace(good, height=np.zeros((0, 3)), confidence=np.zeros((0, 3))),
        dataclasses.replace(good, pose=np.full(4, np.nan)),
        dataclasses.replace(good, height=np.full((4, 4), np.nan), confidence=np.zeros((4, 4))),
    ]
    telemetry = [
        record
        if record.crossing is None
        else dataclasses.replace(
            record, crossing=dataclasses.replace(record.crossing, ground=grounds[k % 3], **bad)
        )
        for k, record in enumerate(rough_run.telemetry[:70])
    ]
    run = dataclasses.replace(
        rough_run, telemetry=telemetry, frames=rough_run.frames[:70], truth=rough_run.truth[:70]
    )
    found = {panel.key: panel for panel in crossing(run, robot).panels}
    assert "gave no point" in found["cloud"].caption
    assert "saw nothing near the robot" in found["map-quality"].caption
    read_page(report_html(run, make_summary(scenario="rough"), robot))


def test_of_many_maps_some_are_shown(rough_run: RunData) -> None:
    (_, ground), _ = maps_of(rough_run)
    many = [MapAt(k, ground) for k in range(40)]
    chosen = [entry.tick for entry in some_maps(many)]
    assert (len(chosen), chosen[0], chosen[-1]) == (8, 0, 39)
