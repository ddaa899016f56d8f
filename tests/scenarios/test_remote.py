"""Runs that a ground station or a script of steps commands."""

import socket
import threading
import time
from types import SimpleNamespace

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.io.link import LinkError
from bluefoot_mpc.io.station.client import RemoteRobot
from bluefoot_mpc.io.station.orders import Order
from bluefoot_mpc.io.station.steps import Steps
from bluefoot_mpc.scenarios import RunOptions, run, runner
from bluefoot_mpc.scenarios.robots import make_robot
from bluefoot_mpc.scenarios.stationed import StationedRun
from bluefoot_mpc.types import Mode, MotionCommand


class Link:
    """A link without a radio."""

    def __init__(self):
        self.arm_requested = self.stop_requested = self.emergency_requested = False
        self.answers, self.published, self.said, self.emergency = [], [], [], None
        self.motion = MotionCommand(mode=Mode.WALK, velocity=np.array([0.05, 0.0])), 0.0

    def command(self, now):
        return self.motion

    def arm_done(self, refusal=""):
        self.arm_requested = False
        self.answers.append(refusal)

    def on_emergency(self, call):
        self.emergency = call

    def publish(self, telemetry, frame, state="", reasons=()):
        self.published.append((str(state), reasons))

    def say(self, text, *, fault=False):
        self.said.append((text, fault))


def supervisor(state="active", reasons=()):
    request = SimpleNamespace(reasons=reasons)
    return SimpleNamespace(state=state, request=request, emergency=lambda reason: None)


def own(time):
    return None if time >= 10.0 else MotionCommand(mode=Mode.SIT)


def test_the_station_leads_where_nothing_else_does():
    assert StationedRun(Link(), own, leads=True)(1.0).mode is Mode.WALK
    assert StationedRun(Link(), own)(1.0).mode is Mode.SIT


@pytest.mark.parametrize("leads", [True, False])
def test_the_run_ends_with_its_own_commands(leads):
    assert StationedRun(Link(), own, leads=leads)(10.0) is None


@pytest.mark.parametrize("leads", [True, False])
@pytest.mark.parametrize("wish", ["stop_requested", "emergency_requested"])
def test_a_stop_is_heeded_whoever_leads(leads, wish):
    link = Link()
    run_ = StationedRun(link, own, leads=leads)
    setattr(link, wish, True)
    assert run_(1.0).mode is Mode.OFF
    setattr(link, wish, False)
    assert run_(1.0).mode is not Mode.OFF


def test_a_powered_robot_that_was_stopped_is_done():
    link = Link()
    run_ = StationedRun(link, own, powered=True)
    boss = supervisor("stopping")
    run_.attach(boss)
    link.stop_requested = True
    assert run_(1.0).mode is Mode.OFF
    boss.state = "stopped"
    assert run_(2.0) is None


@pytest.mark.parametrize(("state", "refused"), [("active", False), ("emergency", True), ("stopped", True)])
def test_arming_is_answered(state, refused):
    link = Link()
    run_ = StationedRun(link, own)
    run_.attach(supervisor(state))
    link.arm_requested = True
    run_(1.0)
    assert bool(link.answers[0]) is refused


def test_an_old_command_is_tamed_and_told():
    link = Link()
    run_ = StationedRun(link, own, leads=True)
    for age, mode in ((0.0, Mode.WALK), (2.0, Mode.STAND), (7.0, Mode.SIT), (31.0, Mode.OFF)):
        link.motion = link.motion[0], age
        assert run_(1.0).mode is mode
    assert [text for text, fault in link.said if fault] == [
        "no command for 1 s: stand", "no command for 5 s: sit", "no command for 30 s: torque off",
    ]  # fmt: skip


@pytest.mark.parametrize("direct", [True, False])
def test_an_emergency_is_carried_out_by_the_thread_that_may(direct):
    link, heard = Link(), []
    run_ = StationedRun(link, own, direct=direct)
    boss = supervisor()
    boss.emergency = heard.append
    run_.attach(boss)
    assert (link.emergency is boss.emergency) is direct
    link.emergency_requested = True
    run_(1.0)
    assert heard == ["asked for by the ground station"]
    boss.state = "emergency"
    run_(1.02)
    assert len(heard) == 1


def test_state_and_reasons_are_published():
    link = Link()
    run_ = StationedRun(link, own, powered=True)
    boss = supervisor("sitting", ("battery low",))
    run_.attach(boss)
    command = SimpleNamespace(torque_limit=np.ones(16))
    output = SimpleNamespace(telemetry=SimpleNamespace(mode=Mode.SIT), command=command)
    run_.observe(None, output, None)
    assert link.published == [("sitting", ("battery low",))]


def options(tmp_path, **more):
    return RunOptions(out=tmp_path, report=False, controller="cpg", **more)


def test_without_a_station_or_a_script_nothing_is_run(tmp_path):
    with pytest.raises(ConfigurationError, match=r"--station ADDRESS"):
        run("remote", options(tmp_path))


@pytest.mark.slow
def test_a_script_of_steps_is_walked(tmp_path):
    text = 'scenario.script="walk 4 forward=0.06; pose 1 pitch=5; sit 2"'
    result = run("remote", options(tmp_path, overrides=(text,)))
    assert result.success
    assert result.data.frames[-1].time == pytest.approx(7.0, abs=0.1)
    assert 0.12 < result.summary["distance_m"] < 0.28
    assert result.data.telemetry[-1].mode is Mode.SIT


@pytest.mark.slow
def test_a_robot_is_walked_stopped_and_armed_by_radio(tmp_path):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    results = []

    def robot():
        chosen = options(tmp_path, station=f"udp:127.0.0.1:{port}", duration=120.0)
        results.append(run("remote", chosen))

    thread = threading.Thread(target=robot)
    thread.start()
    remote = RemoteRobot(f"udpin:127.0.0.1:{port}")
    try:
        remote.play(Steps().walk(5.0, forward=0.08))
        walked = remote.picture().position[0]
        remote.stop()
        end = time.monotonic() + 20.0
        while remote.picture().state != "disarmed" and time.monotonic() < end:
            time.sleep(0.05)
        assert remote.picture().state == "disarmed"
        remote.arm()
        remote.stand(3.0)
        assert remote.picture().mode == "stand"
        remote.link.ask(Order.EMERGENCY)
        thread.join(timeout=30.0)
    finally:
        remote.close()
    assert walked > 0.1
    assert "ground station" in results[0].summary["stop_reason"]


def test_a_run_that_does_not_begin_gives_its_robot_back(monkeypatch, tmp_path):
    closed = []

    def made(*args):
        on = make_robot(*args)
        close = on.robot.close
        on.robot.close = lambda: (closed.append(True), close())
        return on

    monkeypatch.setattr(runner, "make_robot", made)
    options = RunOptions(robot="emulator", station="udp:nowhere.invalid:1", out=tmp_path / "run")
    with pytest.raises(LinkError, match="the host is not known"):
        run("remote", options)
    assert closed
