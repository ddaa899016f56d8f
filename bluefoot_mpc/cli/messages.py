"""What the package logs, as lines on standard error; tracebacks go into a file."""

from __future__ import annotations

import contextlib
import logging
import os
import sys
import tempfile
import time
import traceback
from collections.abc import Iterator
from pathlib import Path

_PACKAGE = "bluefoot_mpc"
_ANNOUNCER = "bluefoot_mpc.viz.live"
"""Logs the address of the live view, which a person needs."""


def keep_traceback(error: BaseException) -> Path:
    """Write an error's traceback into a file of the temporary folder."""
    name = f"bluefoot-error-{time.strftime('%Y%m%d-%H%M%S')}-{os.getpid()}.txt"
    path = Path(tempfile.gettempdir()) / name
    with path.open("a", encoding="utf-8") as stream:
        traceback.print_exception(error, file=stream)
    return path


@contextlib.contextmanager
def messages_on_stderr(debug: bool) -> Iterator[None]:
    """Show warnings and addresses (with `debug` everything) for as long as a command runs."""
    levels = {_PACKAGE: logging.DEBUG if debug else logging.WARNING}
    if not debug:
        levels[_ANNOUNCER] = logging.INFO
    handler = _StandardError(debug)
    before = {name: logging.getLogger(name).level for name in levels}
    for name, level in levels.items():
        logging.getLogger(name).setLevel(level)
    logging.getLogger(_PACKAGE).addHandler(handler)
    try:
        yield
    finally:
        logging.getLogger(_PACKAGE).removeHandler(handler)
        for name, level in before.items():
            logging.getLogger(name).setLevel(level)


class _StandardError(logging.Handler):
    """One line a message, to whatever standard error is at that moment."""

    def __init__(self, debug: bool) -> None:
        super().__init__()
        self._debug = debug

    def emit(self, record: logging.LogRecord) -> None:
        """Print a message."""
        line = f"bluefoot: {record.getMessage()}"
        error = record.exc_info[1] if record.exc_info else None
        if error is not None and self._debug:
            line += "\n" + "".join(traceback.format_exception(error))
        elif error is not None:
            where = keep_traceback(error)
            line += f": {type(error).__name__}: {error} (the traceback is in {where}; --debug shows it)"
        # A status line that a person drives by may stand there: the message takes its place.
        clear = "\r\x1b[K" if sys.stderr.isatty() else ""
        print(clear + line, file=sys.stderr, flush=True)
