"""Ctrl-C, termination and hang-up as wishes to end a run, not as ends of the program."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

_ENDINGS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@contextmanager
def interruptible(tell: Callable[[], None]) -> Iterator[threading.Event]:
    """Turn the first Ctrl-C (or termination, or hang-up) into an event; a second one interrupts for real.

    `tell` is called from the signal's handler at the first.
    """
    event = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield event
        return

    def handle(number: int, stack: FrameType | None) -> None:
        if event.is_set():
            raise KeyboardInterrupt
        event.set()
        tell()

    # What is ignored stays so: nohup, and commands in the background of a script.
    heard = [number for number in _ENDINGS if signal.getsignal(number) is not signal.SIG_IGN]
    previous = {number: signal.signal(number, handle) for number in heard}
    try:
        yield event
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)
