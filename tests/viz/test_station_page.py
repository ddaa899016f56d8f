"""The station's page in a real browser without a window: it shows the robot, and stop reaches it."""

import asyncio
import contextlib
import socket
import time
from dataclasses import replace

import numpy as np
import pytest

from bluefoot_mpc.cli.station import PERIOD, Station
from bluefoot_mpc.cli.station_operator import Operator
from bluefoot_mpc.cli.teleop import Teleop
from bluefoot_mpc.io.station.ground import GroundLink
from bluefoot_mpc.io.station.link import StationLink
from bluefoot_mpc.model.robot import load_robot
from bluefoot_mpc.types import Guided, GuideTask, Mode, NavigationReport
from bluefoot_mpc.viz.station_server import StationServer
from bluefoot_mpc.viz.station_view import StationView, station_page

from ..io.station.made_up import snapshot
from .browser import Browser, find_browser

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(find_browser() is None, reason="no Chromium is installed"),
]


def free_port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def way(guide):
    """How a robot finds its way that has no waypoint behind it yet."""
    if guide is None:
        return None
    return NavigationReport(
        guided=Guided.WAYPOINT if guide.task is GuideTask.GOTO else Guided.FIELD, velocity=np.zeros(2),
        yaw_rate=0.0, pitch=0.0, field=np.zeros(2), potential=0.0, mixing=0.0, marker=np.full(3, np.nan),
        marker_position=np.full(3, np.nan), marker_age=np.inf, clearance=0.31,
        waypoints_left=len(guide.waypoints), reason="a wall",
    )  # fmt: skip


async def publish(link):
    """A robot that rolls from side to side, 50 times a second, and does what it is asked at once."""
    start = time.monotonic()
    while True:
        now = time.monotonic() - start
        wanted = motion(link)
        told = snapshot(
            now,
            mode=wanted.mode,
            rpy=np.array([0.1 * np.sin(3.0 * now), 0.02, 0.5]),
            voltage=11.0 + 0.01 * now,
        )
        telemetry = replace(told.telemetry, motion=wanted, navigation=way(wanted.guide))
        link.publish(telemetry, told.frame, "active")
        await asyncio.sleep(0.02)


@contextlib.asynccontextmanager
async def whole_station():
    """A robot's link, a station with its page, and a browser that has it open."""
    address, model = f"127.0.0.1:{free_port()}", load_robot()
    browser = Browser()
    tasks = []
    with GroundLink(f"udpin:{address}") as ground, StationLink(f"udp:{address}") as robot:
        operator = Operator(ground, Teleop())
        server = StationServer(station_page(model), operator)
        station = Station(link=ground, operator=operator, view=StationView(model), server=server)

        async def turn():
            while True:
                station.turn()
                await asyncio.sleep(PERIOD)

        try:
            tasks = [asyncio.ensure_future(publish(robot)), asyncio.ensure_future(turn())]
            await browser.open(server.url)
            await browser.wait_for("window.station && station.state && station.state.time !== null")
            yield browser, robot, server
        finally:
            for task in tasks:
                task.cancel()
            await browser.leave()
            server.close()


async def until(condition, timeout=10.0):
    end = time.monotonic() + timeout
    while not condition():
        assert time.monotonic() < end, "it did not happen in time"
        await asyncio.sleep(0.02)


def motion(robot):
    return robot.command(time.monotonic())[0]


def text(role):
    return f"document.querySelector('[data-role=\"{role}\"]').textContent"


def test_the_page_shows_changing_values():
    async def look():
        async with whole_station() as (browser, _, _):
            seen = set()
            for _ in range(20):
                seen.add((await browser.value(text("roll")), await browser.value(text("clock"))))
                await asyncio.sleep(0.1)
            rolls, clocks = ({pair[index] for pair in seen} for index in (0, 1))
            assert len(rolls) >= 5
            assert len(clocks) >= 5
            assert await browser.value(text("link")) == "connected"
            assert await browser.value(text("mode")) == "stand"
            assert (await browser.value(text("voltage"))).startswith("11.")
            assert await browser.value(text("yaw")) == "28.6°"
            # The servos' values and the foot switches: one of each leg.
            assert await browser.value("document.querySelectorAll('.joint').length") == 16
            dots = await browser.value(
                "[...document.querySelectorAll('.leg h3 i')].map((dot) => dot.className)"
            )
            assert dots == ["on", "", "unknown", "on"]
            assert await browser.value(text("hottest")) == "45 °C"
            assert browser.complaints == []

    asyncio.run(look())


def test_stop_reaches_the_robot_by_button_and_by_key():
    async def stop():
        async with whole_station() as (browser, robot, _):
            await browser.click('[data-order="walk"]')
            await until(lambda: motion(robot).mode is Mode.WALK)
            await browser.click('[data-order="stop"]')
            await until(lambda: robot.stop_requested)
            assert motion(robot).mode is Mode.OFF
            await browser.wait_for(f"{text('result')} === 'stop: accepted'")
            await browser.click('[data-order="arm"]')
            await until(lambda: robot.arm_requested)
            robot.arm_done()
            await until(lambda: not robot.stop_requested)
            await browser.key("keyDown", "Escape", 27)
            await until(lambda: robot.stop_requested)

    asyncio.run(stop())


def test_emergency_reaches_the_robot():
    async def cut():
        heard = []
        async with whole_station() as (browser, robot, _):
            robot.on_emergency(heard.append)
            await browser.click('[data-order="emergency"]')
            await until(lambda: bool(heard))

    asyncio.run(cut())


def test_the_pad_drives_and_letting_go_stops():
    async def drive():
        async with whole_station() as (browser, robot, _):
            x, y = await browser.centre('[data-role="pad"]')
            await browser.mouse("mousePressed", x, y)
            await browser.mouse("mouseMoved", x, y - 40)
            await until(lambda: motion(robot).velocity[0] > 0.03)
            await browser.mouse("mouseMoved", x - 40, y)
            await until(lambda: motion(robot).yaw_rate > 0.1 and abs(motion(robot).velocity[0]) < 0.005)
            await browser.mouse("mouseReleased", x, y)
            await until(lambda: motion(robot).yaw_rate == 0.0, 2.0)
            await until(lambda: motion(robot).mode is Mode.STAND)

    asyncio.run(drive())


@pytest.mark.parametrize("ending", ["blur", "hidden", "closed", "frozen"])
def test_a_page_that_is_gone_lets_go_of_the_robot(ending):
    async def leave():
        async with whole_station() as (browser, robot, server):
            await browser.key("keyDown", "w", 87)
            await until(lambda: motion(robot).velocity[0] > 0.03)
            if ending == "blur":
                await browser.value("window.dispatchEvent(new Event('blur'))")
            elif ending == "hidden":
                await browser.value(
                    "Object.defineProperty(document, 'hidden', {value: true}),"
                    "document.dispatchEvent(new Event('visibilitychange'))"
                )
            elif ending == "closed":
                for page in tuple(server.shared.pages):
                    page.close()
            else:  # the page hangs: its key is held for ever
                await browser.value(
                    "setTimeout(() => { const t = Date.now(); while (Date.now() < t + 4000); })"
                )
            await until(lambda: not motion(robot).velocity.any(), 2.0)

    asyncio.run(leave())


async def click_map(browser, forward, left):
    """Click on the map at a place, m; gives where that is on the screen."""
    x, y = await browser.value(
        f"(() => {{ const box = document.querySelector('[data-role=\"map\"]').getBoundingClientRect();"
        f" const [x, y] = station.map.pixel({forward}, {left}); return [box.x + x, box.y + y]; }})()"
    )
    await browser.mouse("mousePressed", x, y)
    await browser.mouse("mouseReleased", x, y)


def test_waypoints_clicked_on_the_map_become_the_robots_way():
    async def go():
        async with whole_station() as (browser, robot, _):
            assert await browser.value("document.querySelector('[data-task=\"goto\"]').disabled")
            for count, place in enumerate([(1.2, 1.5), (0.5, 1.8)], start=1):
                await click_map(browser, *place)
                await browser.wait_for(f"station.state.operator.waypoints.length === {count}")
            await browser.click('[data-task="goto"]')
            await until(lambda: motion(robot).guide is not None)
            guide = motion(robot).guide
            assert (motion(robot).mode, guide.task) == (Mode.WALK, GuideTask.GOTO)
            assert guide.waypoints == pytest.approx(np.array([[1.2, 1.5], [0.5, 1.8]]), abs=0.03)
            await browser.wait_for(f"{text('way')}.includes('to waypoint 1 · a wall')")
            assert "0.31 m clear" in await browser.value(text("way"))
            assert (await browser.value(text("mode"))) == "walk · goto"
            # A hand on the keys has priority, at once.
            await browser.key("keyDown", "w", 87)
            await until(lambda: motion(robot).velocity[0] > 0.03)
            assert motion(robot).guide is None
            await browser.key("keyUp", "w", 87)
            await until(lambda: motion(robot).mode is Mode.STAND)
            await browser.click('[data-role="clear"]')
            await browser.wait_for("station.state.operator.waypoints.length === 0")
            assert browser.complaints == []

    asyncio.run(go())


def test_wandering_begins_and_ends_with_its_button_and_with_the_page():
    async def wander():
        async with whole_station() as (browser, robot, server):
            for ending in ("button", "page"):
                await browser.wait_for("!document.querySelector('[data-task=\"wander\"].now')")
                await browser.click('[data-task="wander"]')
                await until(lambda: motion(robot).guide is not None)
                await browser.wait_for("document.querySelector('[data-task=\"wander\"].now') !== null")
                if ending == "button":
                    await browser.click('[data-task="wander"]')
                else:
                    for page in tuple(server.shared.pages):
                        page.close()
                await until(lambda: motion(robot).mode is Mode.STAND)
                assert motion(robot).guide is None

    asyncio.run(wander())


def test_a_robot_that_falls_silent_is_seen():
    async def lose():
        async with whole_station() as (browser, robot, _):
            robot.close()
            await browser.wait_for(f"{text('link')}.startsWith('lost for')")
            assert not await browser.value("document.querySelector('[data-role=\"veil\"]').hidden")

    asyncio.run(lose())
