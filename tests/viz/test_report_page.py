"""The report of a run that finds its way, in a real browser without a window."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from pathlib import Path

import pytest

from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.viz.report import write_report

from .browser import Browser, find_browser
from .synthetic_run import make_summary

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(find_browser() is None, reason="no Chromium is installed"),
]

CHOSEN = "document.querySelector('[data-steps=field] [aria-pressed=true]')"


@pytest.fixture(scope="module")
def page(guided_run: RunData, robot: RobotModel, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("page") / "report.html"
    write_report(guided_run, make_summary(scenario="follow"), robot, path)
    return path


def visit(page: Path, look: Callable[[Browser], Awaitable[None]], window: tuple[int, int]) -> None:
    async def go() -> None:
        browser = Browser(window)
        try:
            await browser.open(page.as_uri())
            await browser.wait_for("Boolean(window.replay && window.replay.clock)")
            await look(browser)
            assert browser.complaints == []
        finally:
            await browser.leave()

    asyncio.run(go())


def test_instants_pictures_and_map_lead_the_replay(page: Path) -> None:
    async def look(browser: Browser) -> None:
        # Scripts came out of their packing, and every figure is drawn.
        figures, drawn = "[data-figure]", "[data-figure] .main-svg"
        count = "document.querySelectorAll('{}').length"
        await browser.wait_for(f"{count.format(drawn)} >= {count.format(figures)}")
        assert await browser.value(f"{CHOSEN}.title") == "closest approach"
        await browser.value("replay.clock.toggle(false)")
        await browser.value("document.querySelector('[data-steps=field] [data-step=\"1\"]').click()")
        label = await browser.value(f"{CHOSEN}.textContent")
        assert await browser.value("replay.clock.time") == pytest.approx(float(label.split()[0]), abs=0.05)
        sweep = "document.querySelector('[data-figure=field]')._fullData[0].x[0]"
        first = await browser.value(sweep)
        await browser.value("document.querySelector('[data-steps=field] [data-step=\"4\"]').click()")
        assert await browser.value(sweep) != first
        await browser.value("document.querySelector('.picture.event').click()")
        assert await browser.value("replay.clock.time") == pytest.approx(3.0, abs=0.01)
        # The replayed robot stands on the map where it was.
        place = await browser.value(
            "(() => { const n = document.querySelector('[data-figure=map]'), f = n._fullLayout;"
            " const h = n.querySelector('.here').style, x = parseFloat(h.left) - f.xaxis._offset;"
            " return [f.xaxis.p2l(x), replay.recording.q[23 * 150], h.display]; })()"
        )
        assert place[0] == pytest.approx(place[1], abs=0.01)
        assert place[2] == "block"

    visit(page, look, (1280, 900))


def test_a_telephone_shows_all_of_it(page: Path) -> None:
    async def look(browser: Browser) -> None:
        await browser.wait_for("document.querySelectorAll('[data-figure=map] .main-svg').length > 0")
        assert await browser.value("document.documentElement.scrollWidth") <= 390

    visit(page, look, (390, 844))
