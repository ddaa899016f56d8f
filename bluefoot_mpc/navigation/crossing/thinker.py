"""Work that takes longer than a tick, done beside the ticks."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from typing import Generic, TypeVar

T = TypeVar("T")
log = logging.getLogger(__name__)


class Thinker(Generic[T]):
    """Does one piece of work in a thread and hands its result over after a fixed number of ticks.

    Never sooner, so that a run and its replay see the same result on the same
    tick, however fast the machine; if the work is not done by then the tick
    waits for it, and counts as late.

    Attributes:
        failure: why the last work gave no result, from its tick until the next begins; else empty.

    Args:
        ticks: after which the result is handed over.
    """

    def __init__(self, ticks: int) -> None:
        self._ticks = max(1, ticks)
        self._thread: threading.Thread | None = None
        self.reset()

    def reset(self) -> None:
        """Forget the work; what still runs ends unheard."""
        self._thread = None
        self._left = 0
        self.failure = ""
        self._result: list[T] = []
        self._failure: list[Exception] = []

    @property
    def busy(self) -> bool:
        """True from `start` until the result was handed over."""
        return self._thread is not None

    def start(self, work: Callable[[], T]) -> None:
        """Begin; whatever was going on before is forgotten.

        Args:
            work: must not touch what the ticks change.
        """
        self.reset()
        result, failure = self._result, self._failure

        def run() -> None:
            try:
                result.append(work())
            except Exception as error:  # the ticks must go on; the one that waits for the result tells
                failure.append(error)

        self._left = self._ticks
        self._thread = threading.Thread(target=run, name="crossing-thinker", daemon=True)
        self._thread.start()

    def step(self) -> T | None:
        """One tick: the result on the last of them, else None; None as well where there is a `failure`."""
        thread = self._thread
        if thread is None:
            return None
        self._left -= 1
        if self._left > 0:
            return None
        thread.join()
        result, failure = self._result, self._failure
        self.reset()
        if failure:
            log.error("thinking failed", exc_info=failure[0])
            self.failure = f"{type(failure[0]).__name__}: {failure[0]}"
            return None
        return result[0]
