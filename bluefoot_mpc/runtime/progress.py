"""Progress of a run: a bar on a terminal, nothing when piped."""

from __future__ import annotations

import time
from types import TracebackType

from rich import progress
from rich.console import Console

_INTERVAL = 0.25
"""s of wall time between two drawings: each costs about a millisecond."""


class Progress:
    """Shows how far a run is; use it as a context manager.

    Drawing happens inside `update` and never in a thread, so that it cannot
    fall into a control tick.

    Args:
        total: s of the run, None when it has no planned end.
        label: what is running.
        console: where to draw; by default standard error.
    """

    def __init__(self, total: float | None, label: str = "running", console: Console | None = None) -> None:
        console = console if console is not None else Console(stderr=True)
        self._bar: progress.Progress | None = None
        self._drawn = float("-inf")
        if console.is_terminal:
            self._bar = progress.Progress(
                progress.TextColumn("{task.description}"),
                progress.BarColumn(),
                progress.TextColumn("{task.completed:6.1f} s {task.fields[note]}"),
                progress.TimeRemainingColumn(),
                console=console,
                auto_refresh=False,
                transient=True,
            )
            self._task = self._bar.add_task(label, total=total, note="")

    def update(self, elapsed: float, note: str = "") -> None:
        """Say how many seconds of the run are done, and a word about them."""
        if self._bar is None:
            return
        now = time.monotonic()
        if now - self._drawn >= _INTERVAL:
            self._drawn = now
            self._bar.update(self._task, completed=elapsed, note=note, refresh=True)

    def __enter__(self) -> Progress:
        if self._bar is not None:
            self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._bar is not None:
            self._bar.stop()
