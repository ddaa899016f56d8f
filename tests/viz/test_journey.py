from __future__ import annotations

import base64
import dataclasses
import json
import math
import re
from typing import Any

import cv2
import numpy as np
import plotly.graph_objects as go
import pytest

from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.navigation import potential_field
from bluefoot_mpc.navigation.config import NavigationConfig
from bluefoot_mpc.navigation.outline import distances
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.runtime.pictures import PictureBook
from bluefoot_mpc.sim.worlds import footprint
from bluefoot_mpc.sim.worlds.plan import Solid
from bluefoot_mpc.types import CameraImage, Guided
from bluefoot_mpc.viz import plots_field
from bluefoot_mpc.viz.camera_strip import MOST, choose
from bluefoot_mpc.viz.journey import Journey, journey_of
from bluefoot_mpc.viz.plots import Panel
from bluefoot_mpc.viz.plots_map import solid_traces
from bluefoot_mpc.viz.plots_way import LEAST_CLEARANCE
from bluefoot_mpc.viz.replay import replay_html
from bluefoot_mpc.viz.report import report_html
from bluefoot_mpc.viz.series import extract
from bluefoot_mpc.viz.style import GUIDED_NAMES

from . import navigating_run as made
from .html_check import read_page
from .navigating_run import WANTED, navigating_run
from .synthetic_run import make_summary

PANELS = ["map", "field", "way", "marker-pixels", "marker-distance"]


def numbers(packed: dict[str, Any]) -> np.ndarray[Any, Any]:
    values = np.frombuffer(base64.b64decode(packed["bdata"]), dtype="<f4")
    return values.reshape([int(n) for n in packed["shape"].split(", ")]) if "shape" in packed else values


def points(trace: dict[str, Any]) -> np.ndarray[Any, Any]:
    return np.column_stack([numbers(trace["x"]), numbers(trace["y"])])


def named(panel: Panel, name: str) -> dict[str, Any]:
    (trace,) = [trace for trace in panel.data if trace.get("name", "").startswith(name)]
    return trace


def journey(run: RunData, robot: RobotModel) -> Journey:
    found = journey_of(run, extract(run, 1.5), robot)
    assert found is not None
    return found


@pytest.fixture(scope="module")
def shown(guided_run: RunData, robot: RobotModel) -> Journey:
    return journey(guided_run, robot)


@pytest.fixture(scope="module")
def panels(shown: Journey) -> dict[str, Panel]:
    return {panel.key: panel for panel in shown.panels}


@pytest.fixture(scope="module")
def html(guided_run: RunData, robot: RobotModel) -> str:
    return report_html(guided_run, make_summary(scenario="follow"), robot)


def test_figures_come_in_order_and_only_for_runs_that_navigate(
    shown: Journey, run: RunData, robot: RobotModel
) -> None:
    assert [panel.key for panel in shown.panels] == PANELS
    assert journey_of(run, extract(run, 1.5), robot) is None


def test_outlines_are_the_plans(panels: dict[str, Panel]) -> None:
    drawn = np.concatenate([points(trace) for trace in panels["map"].data if trace.get("fill") == "toself"])
    for solid in made.room().solids:
        if solid.shape == "box":
            corners = footprint.corners(solid)
        else:
            corners = np.array(
                [[solid.x + 0.5 * solid.size[0], solid.y], [solid.x - 0.5 * solid.size[0], solid.y]]
            )
        for corner in corners:
            assert np.nanmin(np.hypot(*(drawn - corner).T)) < 1e-4


def test_what_hangs_overhead_is_not_filled() -> None:
    top = Solid(name="top", shape="box", x=1.0, y=0.0, z=0.75, size=(0.8, 0.8, 0.04))
    leg = Solid(name="leg", shape="cylinder", x=1.3, y=0.3, z=0.35, size=(0.05, 0.05, 0.7))
    overhead, thing = sorted(solid_traces([top, leg]), key=lambda trace: trace["fill"])
    assert (overhead["fill"], overhead["line"]["dash"]) == ("none", "dot")
    assert thing["hovertext"] == "leg"
    assert np.hypot(*(points(thing)[0] - [1.3, 0.3])) == pytest.approx(0.025, abs=1e-6)


def test_the_way_is_coloured_by_what_led(panels: dict[str, Panel], guided_run: RunData) -> None:
    truth = guided_run.stack("truth", "q")[:, :2]
    led = [t.navigation and str(t.navigation.guided) for t in guided_run.telemetry]
    for name in ("field", "marker", "search"):
        way = points(named(panels["map"], GUIDED_NAMES[name]))
        ticks = [k for k in range(len(led)) if led[k] == name or (k and led[k - 1] == name)]
        assert way[np.isfinite(way[:, 0])] == pytest.approx(truth[ticks], abs=1e-6)
        facts = numbers(named(panels["map"], GUIDED_NAMES[name])["customdata"])
        assert facts[0, 0] == pytest.approx(guided_run.telemetry[ticks[0]].time, abs=1e-5)
    told = points(named(panels["map"], "no task"))
    assert told[0] == pytest.approx(truth[0], abs=1e-6)


def test_the_estimated_way_leader_and_waypoints_are_on_the_map(
    panels: dict[str, Panel], guided_run: RunData
) -> None:
    estimate = guided_run.stack("telemetry", "estimate.position")[:, :2]
    assert points(named(panels["map"], "estimate")) == pytest.approx(estimate, abs=1e-5)
    leader = guided_run.stack("truth", "leader")[:, :2]
    assert points(next(t for t in panels["map"].data if t["name"] == "leader")) == pytest.approx(
        leader, abs=1e-5
    )
    assert points(named(panels["map"], "waypoints")).tolist() == [[1.0, 0.5]]
    assert points(named(panels["map"], "end"))[0] == pytest.approx(guided_run.truth[-1].q[:2], abs=1e-5)


def test_the_closest_approach_is_marked_where_it_was(panels: dict[str, Panel], guided_run: RunData) -> None:
    clearance = guided_run.stack("truth", "clearance")
    tick = int(np.argmin(clearance))
    trace = named(panels["map"], "closest")
    assert f"{1e3 * clearance[tick]:.0f} mm" in trace["name"]
    middle = points(trace)[:-1].mean(axis=0)
    assert middle == pytest.approx(guided_run.truth[tick].q[:2], abs=0.05)


def test_seen_floor_is_that_of_the_coverage(panels: dict[str, Panel]) -> None:
    floor = named(panels["map"], "floor seen")
    seen = numbers(floor["z"])
    share = np.nansum(seen) / np.isfinite(seen).sum()
    assert floor["name"].startswith(f"floor seen, {100 * share:.0f} %")
    column = int(np.argmin(np.abs(numbers(floor["x"]) - 0.5)))
    row = int(np.argmin(np.abs(numbers(floor["y"]))))
    assert seen[row, column] == 1.0  # right in front of the start


def test_without_a_plan_the_map_is_what_the_lidar_met(guided_run: RunData, robot: RobotModel) -> None:
    config = {key: value for key, value in guided_run.config.items() if key != "sim"}
    bare = journey(dataclasses.replace(guided_run, config=config), robot)
    cloud = named(bare.panels[0], "LIDAR")
    assert cloud["visible"] is True
    away = np.min([np.abs(footprint.distance(points(cloud), s)) for s in made.room().solids], axis=0)
    assert np.percentile(away, 90) < 0.12  # the estimate drifts by 0.12 m
    assert not [
        trace for trace in bare.panels[0].data if trace.get("fill") == "toself" and "hovertext" in trace
    ]


def test_clearances_and_speeds_over_time(panels: dict[str, Panel], guided_run: RunData) -> None:
    way = panels["way"]
    assert numbers(named(way, "true")["y"]) == pytest.approx(guided_run.stack("truth", "clearance"), abs=1e-6)
    known = numbers(named(way, "as the robot")["y"])
    assert known[60] == pytest.approx(guided_run.truth[60].clearance + 0.02, abs=1e-6)
    assert np.isnan(known[-1])  # infinite: nothing was near
    limit = [s for s in way.layout["shapes"] if s.get("yref") == "y2"]
    assert [line["y0"] for line in limit] == [LEAST_CLEARANCE]
    forward, turn = [trace for trace in way.data if trace["name"] == "decided"]
    assert np.nanmax(numbers(forward["y"])) == pytest.approx(70.0)
    assert np.nanmax(numbers(turn["y"])) == pytest.approx(math.degrees(made.RATE), rel=1e-5)


def test_bands_tell_what_led_and_for_how_long(panels: dict[str, Panel]) -> None:
    (marker,) = [trace for trace in panels["way"].data if trace["name"].startswith("marker, ")]
    spans = numbers(marker["x"]).reshape(-1, 3)[:, :2]
    assert spans == pytest.approx(np.array([[3.0, 6.0], [8.0, 12.0]]), abs=0.021)
    assert marker["name"] == "marker, 64 %"


def test_marker_in_the_picture_and_its_distance(panels: dict[str, Panel], guided_run: RunData) -> None:
    column, radius, _ = (numbers(trace["y"]) for trace in panels["marker-pixels"].data)
    k = 250
    report = guided_run.telemetry[k].navigation
    assert report is not None
    assert (column[k], radius[k]) == pytest.approx((report.marker[0], report.marker[2]), abs=1e-3)
    assert np.isnan(column[350])
    assert "63.6 %" in panels["marker-pixels"].caption
    wanted = numbers(named(panels["marker-distance"], "wanted")["y"])
    assert np.nanmax(wanted) == pytest.approx(WANTED)
    shaded = [(s["x0"], s["x1"]) for s in panels["marker-distance"].layout["shapes"]]
    assert shaded == [pytest.approx((1.0, 3.0)), pytest.approx((6.0, 8.0))]


def test_field_pictures_are_instants_of_the_run(panels: dict[str, Panel], guided_run: RunData) -> None:
    steps = panels["field"].steps
    assert 5 <= len(steps) <= plots_field.INSTANTS
    assert [step.time for step in steps] == sorted(step.time for step in steps)
    closest = float(guided_run.telemetry[int(np.argmin(guided_run.stack("truth", "clearance")))].time)
    (marked,) = [step for step in steps if step.note == "closest approach"]
    assert marked.time == pytest.approx(closest, abs=0.11)
    assert panels["field"].data is marked.data


def test_field_picture_shows_sweep_forces_and_sum(panels: dict[str, Panel], guided_run: RunData) -> None:
    step = panels["field"].steps[2]
    tick = round(step.time / guided_run.period)
    scan = guided_run.frames[tick].lidar
    assert scan is not None
    traces = {trace["name"]: points(trace) for trace in step.data}
    # Left is negative x, forward is y: rays straight ahead end above the robot.
    assert traces["sweep"].shape == (np.isfinite(scan.distance).sum(), 2)
    field = potential_field.field(
        scan.bearing, np.nan_to_num(scan.distance, nan=5.6), NavigationConfig().field
    )
    start, tip = traces["sum of the field"][:2]
    along = tip - start
    assert math.atan2(-along[0], along[1]) == pytest.approx(math.atan2(*field.force[::-1]), abs=1e-3)
    shafts = traces["pull"].reshape(-1, 6, 2)[:, :2]
    lengths = np.hypot(*(shafts[:, 1] - shafts[:, 0]).T)
    assert lengths.max() == pytest.approx(plots_field.PULL, rel=0.05)
    # Pulls point away from the robot.
    assert (np.hypot(*shafts[:, 1].T) > np.hypot(*shafts[:, 0].T)).all()


def test_pushes_point_at_the_robot() -> None:
    bearing = np.radians([-20.0, 0.0, 20.0])
    force = np.array([-0.01, -0.02, 0.5])
    line = plots_field.force_arrows(np.zeros(2), bearing, np.array([0.4, 0.3, 3.0]), force, pulls=False)
    shafts = line.reshape(-1, 6, 2)[:, :2]
    assert shafts[:, 0] == pytest.approx(np.array([[0.376, -0.137], [0.3, 0.0]]), abs=1e-3)
    assert shafts[1, 1] == pytest.approx([0.3 - plots_field.PUSH, 0.0])
    assert np.hypot(*(shafts[0, 1] - shafts[0, 0])) == pytest.approx(0.5 * plots_field.PUSH)


def test_outlines_have_the_guards_distance() -> None:
    guard = NavigationConfig().guard
    ring = plots_field.box_outline(guard.outline, guard.least)
    assert distances(ring, guard.outline) == pytest.approx(guard.least, abs=1e-9)
    assert ring[0] == pytest.approx(ring[-1])


def test_the_way_ahead_is_an_arc() -> None:
    arc = plots_field.way_ahead(np.array([0.2, 0.0]), 0.5)
    radius = 0.4
    away = np.hypot(arc[:25, 0], arc[:25, 1] - radius)
    assert away == pytest.approx(radius, abs=2e-3)
    turn = plots_field.way_ahead(np.zeros(2), -0.5)
    assert np.hypot(*turn[:25].T) == pytest.approx(np.hypot(*turn[0]))
    assert math.atan2(turn[24, 1], turn[24, 0]) == pytest.approx(-1.5)
    assert len(plots_field.way_ahead(np.zeros(2), 0.0)) == 1
    assert len(plots_field.way_ahead(np.full(2, np.nan), np.nan)) == 1


def test_overlays_stand_where_the_marker_was_found(shown: Journey, guided_run: RunData) -> None:
    found = [picture for picture in shown.strip if picture.column is not None]
    assert found
    assert len(found) < len(shown.strip) <= MOST
    for picture in found:
        pixels = decode(picture.source)
        scale = picture.width / pixels.shape[1]
        assert (picture.width, picture.height) == (640, 480)
        # The disc that the page draws its circle around is really there.
        v, u = np.mgrid[: pixels.shape[0], : pixels.shape[1]]
        pink = (pixels[:, :, 0].astype(int) - pixels[:, :, 1] > 120) & (pixels[:, :, 2] > 80)
        middle = scale * (np.array([u[pink].mean(), v[pink].mean()]) + 0.5)
        assert middle == pytest.approx([picture.column, picture.row], abs=2.5)
        assert scale * math.sqrt(pink.sum() / math.pi) == pytest.approx(picture.radius, abs=2.5)
        angle = math.degrees(math.atan2(320.0 - float(picture.column or 0.0), made.FOCAL))
        assert picture.bearing == f"{angle:.1f}° left"
        assert re.fullmatch(r"\d\.\d\d m \(true \d\.\d\d\)", picture.distance)
    events = [picture.label for picture in shown.strip if picture.is_event]
    assert events == ["marker first seen", "marker lost", "marker seen again"]


def test_pictures_are_spread_over_a_long_run(guided_run: RunData) -> None:
    kept = guided_run.pictures.pictures()
    long = [
        dataclasses.replace(kept[k % 3], time=2.0 * k, event="marker lost" if k % 4 == 0 else "")
        for k in range(40)
    ]
    chosen = choose(long)
    assert len(chosen) == MOST
    times = [picture.time for picture in chosen]
    assert times == sorted(times)
    assert times[0] == 0.0
    assert times[-1] >= 76.0
    assert sum(bool(picture.event) for picture in chosen) == MOST // 2


def test_overlays_on_the_page(html: str, shown: Journey) -> None:
    page = read_page(html)
    assert "camera" in page.ids
    circles = re.findall(r'<circle class="found" cx="([\d.]+)" cy="([\d.]+)" r="([\d.]+)"', html)
    expected = [(p.column, p.row, p.radius) for p in shown.strip if p.column is not None]
    assert np.array(circles, dtype=float) == pytest.approx(np.array(expected, dtype=float), abs=0.06)


def test_every_figure_is_valid_plotly(html: str) -> None:
    figures = json.loads(read_page(html).texts["figures"])
    for key in PANELS:
        for data in [figures[key]["data"], *(step["data"] for step in figures[key].get("steps", []))]:
            text = json.dumps({"data": data, "layout": figures[key]["layout"]})
            assert len(go.Figure(json.loads(re.sub(r'"@\w+"', '"#000000"', text))).data) > 0
    assert figures["map"]["follows"] is True


def test_the_replay_has_world_leader_and_sweeps(html: str, guided_run: RunData) -> None:
    data = json.loads(read_page(html).texts["run-data"])
    (things,) = [command for command in data["surroundings"] if command["path"].endswith("/things")]
    assert len(things["object"]["geometries"]) == len(made.room().solids)
    assert data["bounds"] == list(made.room().bounds)
    leader, truth = data["leader"], guided_run.stack("truth", "leader")
    assert numbers(leader["pose"]) == pytest.approx(
        truth[:: len(truth) // len(numbers(leader["time"]))], abs=1e-5
    )
    assert numbers(leader["turned"])[-1] == pytest.approx([2.0 * 11.9, 2.5 * 11.9], abs=0.05)
    sweeps = data["sweeps"]
    rays, time = len(numbers(sweeps["bearing"])), numbers(sweeps["time"])
    millimetres = np.frombuffer(base64.b64decode(sweeps["distance"]), "<u2").reshape(len(time), rays)
    scan = guided_run.frames[50].lidar
    assert scan is not None
    assert time[10] == pytest.approx(scan.time)
    assert millimetres[10] == pytest.approx(1e3 * np.nan_to_num(scan.distance[::3]), abs=0.51)


def test_a_run_without_truth_leader_or_pictures_has_a_report(robot: RobotModel) -> None:
    run = navigating_run(robot, duration=6.0, truth=False, camera=False, leader=False)
    page = read_page(report_html(run, make_summary(scenario="follow", robot="hardware"), robot))
    assert "camera" not in page.ids
    assert set(PANELS) <= set(page.ids)
    data = json.loads(page.texts["run-data"])
    assert data["leader"] is None
    assert data["sweeps"] is not None


def test_a_run_that_only_scans_gets_a_map(robot: RobotModel) -> None:
    run = navigating_run(robot, duration=3.0, camera=False, leader=False)
    run.telemetry = [dataclasses.replace(t, navigation=None) for t in run.telemetry]
    assert [panel.key for panel in journey(run, robot).panels] == ["map"]


def test_replay_of_a_log_shows_the_same(guided_run: RunData, robot: RobotModel) -> None:
    page = read_page(replay_html(guided_run, robot))
    assert set(PANELS) | {"camera", "replay"} <= set(page.ids)


def test_pictures_that_are_still_in_the_frames_are_shown(guided_run: RunData, robot: RobotModel) -> None:
    image = CameraImage(time=3.0, pixels=np.full((480, 640, 3), 90, np.uint8), valid=True)
    frames = list(guided_run.frames)
    frames[150] = dataclasses.replace(frames[150], camera=image)
    strip = journey(dataclasses.replace(guided_run, frames=frames, pictures=PictureBook()), robot).strip
    assert strip[0].time == pytest.approx(3.0)
    assert strip[0].label == "marker first seen"
    assert np.abs(decode(strip[0].source).astype(int) - 90).max() <= 2


def decode(source: str) -> np.ndarray[Any, Any]:
    kind, _, data = source.partition(",")
    assert kind == "data:image/jpeg;base64"
    image = cv2.imdecode(np.frombuffer(base64.b64decode(data), np.uint8), cv2.IMREAD_COLOR)
    assert image is not None
    return np.asarray(image[:, :, ::-1])


def test_bad_sweeps_do_not_spoil_the_report(guided_run: RunData, robot: RobotModel) -> None:
    frames = list(guided_run.frames)
    good = frames[5].lidar
    assert good is not None
    bad = [
        dataclasses.replace(good, distance=good.distance[:100]),
        dataclasses.replace(good, bearing=np.zeros(0), distance=np.zeros(0)),
        dataclasses.replace(good, distance=np.full_like(good.distance, np.nan)),
        dataclasses.replace(good, bearing=good.bearing[:341], distance=good.distance[:341]),
        dataclasses.replace(good, valid=False),
    ]
    for k in range(100):
        frames[5 * k] = dataclasses.replace(frames[5 * k], lidar=bad[k % len(bad)])
    page = read_page(report_html(dataclasses.replace(guided_run, frames=frames), make_summary(), robot))
    assert set(PANELS) <= set(page.ids)


def test_a_robot_that_has_arrived_is_shown_once(guided_run: RunData, robot: RobotModel) -> None:
    telemetry = [
        dataclasses.replace(t, navigation=dataclasses.replace(t.navigation, guided=Guided.ARRIVED))
        if t.navigation is not None and t.time >= 4.0
        else t
        for t in guided_run.telemetry
    ]
    shown = journey(dataclasses.replace(guided_run, telemetry=telemetry), robot)
    assert [picture.time for picture in shown.strip if picture.label == "arrived"] == [pytest.approx(10.0)]
    assert all(step.time < 4.0 for panel in shown.panels for step in panel.steps)
