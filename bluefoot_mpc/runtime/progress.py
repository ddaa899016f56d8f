"""Progress of a run: a bar on a terminal, nothing when piped."""

from __future__ import annotations

import time
from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

_INTERVAL = 0.25
"""s of wall time between two drawings: each costs about a millisecond."""


class ProgressBar:
    """Shows how far a run is; use it as a context manager.

    Drawing happens inside `update` and never in a thread, so that it cannot
    fall into a control tick.

    Args:
        label: what is running.
        total: s of the run, None when it has no planned end.
        console: where to draw; by default standard error.
    """

    def __init__(self, label: str, total: float | None, console: Console | None = None) -> None:
        console = console if console is not None else Console(stderr=True)
        self._progress: Progress | None = None
        self._drawn = float("-inf")
        if console.is_terminal:
            self._progress = Progress(
                TextColumn("{task.description}"),
                BarColumn(),
                TextColumn("{task.completed:6.1f} s {task.fields[note]}"),
                TimeRemainingColumn(),
                console=console,
                auto_refresh=False,
                transient=True,
            )
            self._task = self._progress.add_task(label, total=total, note="")

    def update(self, elapsed: float, note: str = "") -> None:
        """Say how many seconds of the run are done, and a word about them."""
        if self._progress is None:
            return
        now = time.monotonic()
        if now - self._drawn >= _INTERVAL:
            self._drawn = now
            self._progress.update(self._task, completed=elapsed, note=note, refresh=True)

    def __enter__(self) -> ProgressBar:
        if self._progress is not None:
            self._progress.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._progress is not None:
            self._progress.stop()
