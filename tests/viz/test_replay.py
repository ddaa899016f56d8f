from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import pytest

from bluefoot_mpc.exceptions import LogError
from bluefoot_mpc.model.parameters import load_parameters
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.settings import to_table
from bluefoot_mpc.viz import replay as replay_module
from bluefoot_mpc.viz.replay import play, replay

from .html_check import read_page


@pytest.fixture
def log(run: RunData) -> RunData:
    return dataclasses.replace(run, config={**run.config, "model": to_table(load_parameters())})


def test_page_alone(log: RunData, tmp_path: Path) -> None:
    replay(log, html=tmp_path / "replay.html")
    text = (tmp_path / "replay.html").read_text(encoding="utf-8")
    page = read_page(text)
    assert "replay" in page.ids
    assert len(json.loads(page.texts["run-data"])["nodes"]) == 17
    assert len(text) < 2.5e6


def test_log_without_a_robot(run: RunData, tmp_path: Path) -> None:
    with pytest.raises(LogError, match="does not describe its robot"):
        replay(run, html=tmp_path / "replay.html")


class FakeView:
    def __init__(self, robot: object) -> None:
        self.url, self.alive, self.pages, self.closed = "http://here/", True, 1, False
        self.times: list[float] = []

    def show(self, telemetry, truth=None, scan=None) -> None:
        assert telemetry.time == truth.time
        self.times.append(telemetry.time)

    def close(self) -> None:
        self.closed = True


def test_plays_every_tick_and_closes(log: RunData, monkeypatch: pytest.MonkeyPatch) -> None:
    views: list[FakeView] = []

    def make(robot: object, stage: object) -> FakeView:
        views.append(FakeView(robot))
        return views[-1]

    told: list[str] = []
    monkeypatch.setattr(replay_module, "LiveView", make)
    monkeypatch.setattr(replay_module.time, "sleep", lambda s: None)
    short = dataclasses.replace(log, telemetry=log.telemetry[:30])
    replay(short, view=True, announce=told.append)
    assert told == ["http://here/"]
    assert views[0].times == [t.time for t in short.telemetry]
    assert views[0].closed


def test_keeps_its_pace(log: RunData, monkeypatch: pytest.MonkeyPatch) -> None:
    clock = [0.0]
    monkeypatch.setattr(replay_module.time, "monotonic", lambda: clock[0])
    monkeypatch.setattr(replay_module.time, "sleep", lambda s: clock.__setitem__(0, clock[0] + s))
    play(dataclasses.replace(log, telemetry=log.telemetry[:51]), FakeView(None), speed=2.0)
    assert clock[0] == pytest.approx(0.5)
