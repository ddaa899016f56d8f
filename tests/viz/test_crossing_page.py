"""The report of a run over rough ground, in a real browser without a window."""

from __future__ import annotations

from pathlib import Path

import pytest

from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.viz.report import write_report

from . import crossing_run as made
from .browser import Browser, find_browser
from .crossing_run import crossing_run
from .synthetic_run import make_summary
from .test_report_page import visit

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(find_browser() is None, reason="no Chromium is installed"),
]


@pytest.fixture(scope="module")
def page(robot: RobotModel, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("page") / "report.html"
    write_report(crossing_run(robot), make_summary(scenario="rough"), robot, path)
    return path


def test_maps_lead_the_replay(page: Path) -> None:
    async def look(browser: Browser) -> None:
        for key in ("ground", "map-quality", "crossing", "side", "cost"):
            await browser.wait_for(f"document.querySelectorAll('[data-figure={key}] .main-svg').length > 0")
        chosen = "document.querySelector('[data-steps=ground] [aria-pressed=true]')"
        assert await browser.value(f"{chosen}.title") == "the last map"
        await browser.value("replay.clock.toggle(false)")
        await browser.value("document.querySelector('[data-steps=ground] [data-step=\"0\"]').click()")
        assert await browser.value("replay.clock.time") == pytest.approx(made.WALKS - 0.05, abs=0.03)
        # Maps keep their aspect.
        scale = await browser.value(
            "(() => { const f = document.querySelector('[data-figure=ground]')._fullLayout;"
            " return [f.xaxis, f.yaxis].map((a) => a._length / Math.abs(a.range[1] - a.range[0])); })()"
        )
        assert scale[0] == pytest.approx(scale[1], rel=0.01)

    visit(page, look, (1280, 900))


def test_a_telephone_shows_all_of_it(page: Path) -> None:
    async def look(browser: Browser) -> None:
        await browser.wait_for("document.querySelectorAll('[data-figure=cost] .main-svg').length > 0")
        assert await browser.value("document.documentElement.scrollWidth") <= 390

    visit(page, look, (390, 844))
