"""A bar on a terminal, nothing elsewhere."""

from __future__ import annotations

import io

from rich.console import Console

from bluefoot_mpc.runtime.progress import Progress


def shown(terminal: bool) -> str:
    stream = io.StringIO()
    console = Console(file=stream, force_terminal=terminal, width=80)
    with Progress(10.0, "walk", console) as progress:
        for tick in range(1000):
            progress.update(0.02 * tick, "60 mm/s")
    return stream.getvalue()


def test_nothing_when_piped() -> None:
    assert shown(terminal=False) == ""


def test_a_bar_on_a_terminal_that_is_not_drawn_at_every_tick() -> None:
    text = shown(terminal=True)
    assert "walk" in text
    assert "60 mm/s" in text
    assert text.count("walk") < 50
