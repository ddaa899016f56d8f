from __future__ import annotations

import contextlib
import json
import socket
import time
import urllib.request
from collections.abc import Callable

import pytest

from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.viz import live as live_module
from bluefoot_mpc.viz.live import LiveView, live_page, live_state
from bluefoot_mpc.viz.replay import play

from .html_check import PageReader


def wait_for(condition: Callable[[], bool], timeout: float = 10.0) -> bool:
    end = time.monotonic() + timeout
    while time.monotonic() < end:
        if condition():
            return True
        time.sleep(0.02)
    return False


@contextlib.contextmanager
def looking_on(view: LiveView):
    """A page's web socket, as a browser opens it (RFC 6455)."""
    host, port = view.url.removeprefix("http://").strip("/").split(":")
    with socket.create_connection((host, int(port)), timeout=10.0) as connection:
        connection.sendall(
            f"GET /state HTTP/1.1\r\nHost: {host}:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            f"Origin: http://{host}:{port}\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
            "Sec-WebSocket-Version: 13\r\n\r\n".encode()
        )
        stream = connection.makefile("rb")
        assert b"101" in stream.readline()
        while stream.readline().strip():
            pass
        yield stream
        stream.close()


def read_message(stream) -> dict[str, object]:
    head = stream.read(2)
    length = head[1] & 127
    if length == 126:
        length = int.from_bytes(stream.read(2), "big")
    return json.loads(stream.read(length))


@pytest.fixture
def view(robot: RobotModel):
    view = LiveView(robot)
    yield view
    view.close()


def test_serves_on_loopback_shows_states_and_frees_its_port(view: LiveView, run: RunData) -> None:
    assert view.url.startswith("http://127.0.0.1:")
    with urllib.request.urlopen(view.url, timeout=10.0) as answer:
        assert b"MeshCat" in answer.read()
    with looking_on(view) as stream:
        assert wait_for(lambda: view.pages == 1)
        view.show(run.telemetry[60], run.truth[60])
        state = read_message(stream)
        assert state["q"] == pytest.approx(list(run.truth[60].q))
        assert state["mode"] == "walk"
    assert wait_for(lambda: view.pages == 0)
    port = int(view.url.rsplit(":", 1)[1].strip("/"))
    view.close()
    view.close()
    with socket.socket() as free:
        free.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        free.bind(("127.0.0.1", port))


def test_only_loopback_listens(view: LiveView) -> None:
    port = int(view.url.rsplit(":", 1)[1].strip("/"))
    with socket.socket() as other:
        # Another loopback address would be served too if the server listened everywhere.
        assert other.connect_ex(("127.0.0.2", port)) != 0


def test_updates_never_wait(view: LiveView, run: RunData) -> None:
    start = time.perf_counter()
    for telemetry, truth in zip(run.telemetry, run.truth, strict=True):
        view.show(telemetry, truth)
    assert (time.perf_counter() - start) / len(run.telemetry) < 1e-3


def test_death_of_the_server_does_not_reach_the_run(view: LiveView, run: RunData) -> None:
    assert view._link is not None
    view._link._process.kill()
    view._link._process.wait()
    assert not view.alive
    for telemetry in run.telemetry[:20]:
        view.show(telemetry)
        time.sleep(0.005)
    play(run, view)
    view.close()


def test_no_server_is_no_error(robot: RobotModel, run: RunData, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(html: str) -> None:
        raise OSError("no port")

    monkeypatch.setattr(live_module, "LiveLink", refuse)
    view = LiveView(robot)
    assert (view.url, view.alive, view.pages) == ("", False, 0)
    view.show(run.telemetry[0])
    view.close()


def test_page_loads_nothing_but_its_own_states(robot: RobotModel) -> None:
    page = PageReader(live_page(robot))
    assert page.open == []
    assert page.references == []
    assert "ws://127.0.0.1:*" in page.policy
    assert "http" not in page.policy


def test_state_without_truth_is_the_estimate(hardware_run: RunData) -> None:
    telemetry = hardware_run.telemetry[60]
    state = live_state(telemetry, None)
    assert state["com"] is None
    assert list(state["q"][:3]) == list(telemetry.estimate.position)
    assert state["states"] & 15 == int(telemetry.estimate.contact @ [1, 2, 4, 8])
