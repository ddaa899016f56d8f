"""Starts the live view's server and passes states to it."""

from __future__ import annotations

import logging
import subprocess
import sys
import threading
from typing import Any

import orjson

_LOG = logging.getLogger(__name__)
_START_TIMEOUT = 10.0  # s


class LiveLink:
    """The live view's server, in a process of its own.

    Once the server runs nothing here raises: when it dies, the link goes quiet.

    Args:
        html: the page to serve.

    Raises:
        OSError: the server could not be started.

    Attributes:
        url: address of the page.
        pages: number of browser pages that look on.
    """

    def __init__(self, html: str) -> None:
        self.url = ""
        self.pages = 0
        self._started = threading.Event()
        self._process = subprocess.Popen(
            [sys.executable, "-m", "bluefoot_mpc.viz.live_server"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            # Ctrl-C at the terminal is for the run, which then closes the server.
            start_new_session=True,
        )
        self._broken = False
        self._listener = threading.Thread(target=self._listen, name="live view answers", daemon=True)
        self._listener.start()
        self.send(html)
        if not self._started.wait(_START_TIMEOUT) or not self.url:
            self.close()
            raise OSError("the live view's server did not start")

    @property
    def alive(self) -> bool:
        """False once the server is gone."""
        return not self._broken and self._process.poll() is None

    def send(self, value: Any) -> None:
        """Pass a JSON value on; may wait for a server that is behind, so call it from a thread."""
        pipe = self._process.stdin
        if self._broken or pipe is None or pipe.closed:
            return
        try:
            pipe.write(orjson.dumps(value, option=orjson.OPT_SERIALIZE_NUMPY | orjson.OPT_APPEND_NEWLINE))
            pipe.flush()
        except (OSError, ValueError) as error:
            # ValueError: closed from another thread meanwhile.
            self._broken = True
            _LOG.debug("the live view's server hung up: %s", error)

    def close(self) -> None:
        """End the server and free its port. Idempotent."""
        self._broken = True
        if self._process.stdin is not None and not self._process.stdin.closed:
            try:
                self._process.stdin.close()
            except OSError:
                _LOG.debug("the live view's server left before its input was closed")
        try:
            self._process.wait(timeout=2.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._listener.join(timeout=2.0)
        if self._process.stdout is not None:
            self._process.stdout.close()

    def _listen(self) -> None:
        """Take in what the server tells, until it ends."""
        for line in self._process.stdout or ():
            name, _, value = line.decode("utf-8", "replace").strip().partition("=")
            if name == "url":
                self.url = value
                self._started.set()
            elif name == "pages" and value.isdigit():
                self.pages = int(value)
        self._started.set()
