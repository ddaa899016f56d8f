"""Garbage collection that never stalls a control tick.

Python frees nearly everything by counting references. Its collector of cycles
looks at every object now and then, which takes 60 ms once plots and viewers
are imported: three ticks. Inside the loop it looks at young objects only.
"""

from __future__ import annotations

import gc
from types import TracebackType

INTERVAL = 50
"""Ticks between two collections of what is younger than one of them: 0.1 ms each."""


class YoungCollection:
    """Collects cycles of young objects, as a context manager around a loop.

    Older cycles wait until the loop has ended. Where the collector is switched
    off already, nothing is changed.
    """

    def __init__(self) -> None:
        self._active = False
        self._ticks = 0

    def __enter__(self) -> YoungCollection:
        self._active = gc.isenabled()
        if self._active:
            gc.disable()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._active:
            gc.enable()

    def tick(self) -> None:
        """To be called once per tick."""
        self._ticks += 1
        if self._active and self._ticks % INTERVAL == 0:
            gc.collect(1)
