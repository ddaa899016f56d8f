from __future__ import annotations

import pytest

from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.viz.guided_series import extract_guided
from bluefoot_mpc.viz.report import report_html
from bluefoot_mpc.viz.series import extract
from bluefoot_mpc.viz.verdict import verdict
from bluefoot_mpc.viz.verdict_way import way_events, way_tiles

from .html_check import read_page
from .synthetic_run import make_summary

FIGURES = {
    "closest_approach_m": 0.1234, "path_m": 11.26, "in_view_percent": 97.25, "seen_percent": None,
    "waypoint_distance_m": [0.05, 0.11, None], "collisions": [],
}  # fmt: skip
CHECKS = [
    {"name": "leader in view", "holds": False, "detail": "", "figure": "in_view_percent", "goal": "goal 98 %"}
]


def test_tiles_show_what_the_run_has_and_what_was_asked_of_it() -> None:
    tiles = {tile.label: tile for tile in way_tiles(make_summary(figures=FIGURES), CHECKS)}
    assert set(tiles) == {"Closest approach", "Way", "Marker in view", "Waypoints missed by"}
    assert (tiles["Closest approach"].value, tiles["Closest approach"].unit) == ("0.123", "m")
    assert tiles["Closest approach"].status == ""
    assert (tiles["Marker in view"].status, tiles["Marker in view"].note) == ("bad", "goal 98 %")
    assert tiles["Waypoints missed by"].value == "0.11"
    assert way_tiles(make_summary()) == []


def test_the_headline_tells_the_way() -> None:
    judged = verdict(make_summary(scenario="wander", figures=FIGURES))
    assert judged.headline == "The robot wandered over 11.3 m in 60 s"


def test_events_of_the_way(guided_run: RunData, robot: RobotModel) -> None:
    guided = extract_guided(guided_run, extract(guided_run, 1.5), robot.parameters.sensors)
    assert guided is not None
    events = sorted(way_events(guided_run, guided))
    assert [text for _, text in events] == [
        "led by: search", "touches chair1", "led by: marker", "marker first seen", "led by: potential field",
        "led by: search", "marker lost", "led by: marker", "marker seen again",
    ]  # fmt: skip
    times = {text: time for time, text in events}
    assert times["marker first seen"] == pytest.approx(3.0)
    assert times["marker lost"] == pytest.approx(7.02)
    page = report_html(guided_run, make_summary(scenario="follow"), robot)
    assert "touches chair1" in page
    assert "events" in read_page(page).ids
