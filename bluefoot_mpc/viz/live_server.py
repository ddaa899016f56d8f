"""The live view's own process: one page and one web socket, on the loopback interface only.

Run as ``python -m bluefoot_mpc.viz.live_server``. Standard input brings JSON,
one value per line: first the page, then one state of the robot after the other.
Standard output tells ``url=...`` and, whenever it changes, ``pages=...``. The
process ends when its input does, so it never outlives the run that started it.
"""

from __future__ import annotations

import asyncio
import json
import sys
import threading

from tornado import web, websocket

HOST = "127.0.0.1"
PORTS = range(7000, 7100)
"""Tried in turn; a fixed beginning keeps the address in a browser's history valid."""


class StateSocket(websocket.WebSocketHandler):
    """One browser page that looks on."""

    pages: set[StateSocket]
    newest: list[str]

    def initialize(self, pages: set[StateSocket], newest: list[str]) -> None:
        """Take what all pages share: who they are, and the newest state."""
        self.pages = pages
        self.newest = newest
        self.sending = False

    def open(self, *args: str, **kwargs: str) -> None:
        """Count the page in, and show it where the robot is."""
        self.pages.add(self)
        _tell("pages", len(self.pages))
        if self.newest:
            self.offer(self.newest[0])

    def on_close(self) -> None:
        """Count the page out."""
        self.pages.discard(self)
        _tell("pages", len(self.pages))

    def on_message(self, message: str | bytes) -> None:
        """Pages have nothing to say."""

    def offer(self, state: str) -> None:
        """Send a state, unless the page is still busy with the one before."""
        if not self.sending:
            self.sending = True
            # The loop itself holds tasks only weakly.
            self.task = asyncio.ensure_future(self._send(state))

    async def _send(self, state: str) -> None:
        try:
            await self.write_message(state)
        except websocket.WebSocketClosedError:
            self.pages.discard(self)
        finally:
            self.sending = False


class Page(web.RequestHandler):
    """The page itself."""

    def initialize(self, html: str) -> None:
        """Take the page's text."""
        self.html = html

    def get(self) -> None:
        """Serve it, never from a cache: the next run brings another."""
        self.set_header("Cache-Control", "no-store")
        self.finish(self.html)


async def serve(html: str) -> None:
    """Serve the page and pass on every state that comes in, until the input ends."""
    pages: set[StateSocket] = set()
    newest: list[str] = []
    app = web.Application(
        [(r"/", Page, {"html": html}), (r"/state", StateSocket, {"pages": pages, "newest": newest})]
    )
    _tell("url", f"http://{HOST}:{_listen(app)}/")
    loop = asyncio.get_running_loop()
    ended = asyncio.Event()

    def spread(state: str) -> None:
        newest[:] = [state]
        for page in tuple(pages):
            page.offer(state)

    def read() -> None:
        for line in sys.stdin:
            loop.call_soon_threadsafe(spread, line)
        loop.call_soon_threadsafe(ended.set)

    threading.Thread(target=read, daemon=True).start()
    await ended.wait()


def main() -> None:
    """Read the page, then serve."""
    first = sys.stdin.readline()
    if first:
        asyncio.run(serve(json.loads(first)))


def _listen(app: web.Application) -> int:
    """The port that was free."""
    for port in PORTS:
        try:
            app.listen(port, address=HOST)
        except OSError:
            continue
        return port
    raise OSError(f"no free port in {PORTS.start}..{PORTS.stop - 1}")


def _tell(name: str, value: object) -> None:
    sys.stdout.write(f"{name}={value}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
