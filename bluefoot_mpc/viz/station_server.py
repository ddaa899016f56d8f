"""The station's page: served to browsers on this machine only, unless a person asked for more.

Whoever can reach the page can drive the robot. So the server listens on the
loopback interface; on any other it wants a token, in the page's address and in
the web socket's. In both cases the names that the browser gives (Host and
Origin) must be the server's own: no other web page can open the socket.
"""

from __future__ import annotations

import hmac
import ipaddress
import json
import secrets
import socket
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol
from urllib.parse import urlsplit

import orjson
from tornado import httpserver, web, websocket

from bluefoot_mpc.exceptions import ConfigurationError

LOOPBACK = "127.0.0.1"
PORTS = range(7100, 7200)
"""Tried in turn; a fixed beginning keeps the address in a browser's history valid."""
_POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' 'unsafe-eval'; style-src 'unsafe-inline'; "
    "img-src data: blob:; font-src data:; frame-ancestors 'none'"
)
_FARTHEST = 1000.0
"""m; no waypoint is farther from where the run started."""
_LONGEST = 2000
"""bytes; no message of the page is longer."""


class Console(Protocol):
    """The operator's side of the station: what pages may ask of it."""

    def sticks(self, page: int, values: tuple[float, float, float]) -> None:
        """Forward, left, turn left, each -1..1; a dead man's handle: said again and again."""
        ...

    def trunk(self, values: tuple[float, float, float, float]) -> None:
        """Roll, pitch, yaw and height of the trunk, each -1..1 of what is allowed."""
        ...

    def gait(self, name: str) -> None:
        """The gait to walk with."""
        ...

    def order(self, name: str) -> None:
        """Arm, stop and so on."""
        ...

    def task(self, page: int, name: str) -> None:
        """The robot is to find its own way: wander, go to the waypoints and so on."""
        ...

    def waypoint(self, forward: float, left: float) -> None:
        """One more point to go to, m forward and m to the left of where the run started."""
        ...

    def clear(self) -> None:
        """No waypoints any more."""
        ...

    def gone(self, page: int) -> None:
        """A page closed."""
        ...


@dataclass(slots=True)
class Shared:
    """What all handlers share.

    Attributes:
        html: the page.
        console: takes what pages say.
        token: what their addresses must carry; empty: nothing.
        pages: those that look on.
        newest: the newest state, as JSON.
    """

    html: str
    console: Console
    token: str = ""
    pages: set[StateSocket] = field(default_factory=set)
    newest: bytes = b""


def is_loopback(host: str) -> bool:
    """True for an address that only this machine reaches."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


class _Guarded(web.RequestHandler):
    """A handler that knows whom it may serve."""

    shared: Shared

    def initialize(self, shared: Shared) -> None:
        """Take what all share."""
        self.shared = shared

    def prepare(self) -> None:
        """Refuse whoever has no token, or was sent here under a foreign name."""
        given = self.get_query_argument("token", "")
        if self.shared.token:
            if not hmac.compare_digest(given.encode(), self.shared.token.encode()):
                raise web.HTTPError(403, "the address lacks the token that the station printed")
        elif not is_loopback(urlsplit(f"//{self.request.host}").hostname or ""):
            # A name that somebody else's server gives to 127.0.0.1 would make foreign pages our own.
            raise web.HTTPError(403, "open the page by the address that the station printed")


class Page(_Guarded):
    """The page itself."""

    def get(self) -> None:
        """Serve it, never from a cache and never inside another page."""
        self.set_header("Cache-Control", "no-store")
        self.set_header("Referrer-Policy", "no-referrer")
        self.set_header("X-Frame-Options", "DENY")
        self.set_header("Content-Security-Policy", f"{_POLICY}; connect-src 'self' ws://{self.request.host}")
        self.finish(self.shared.html)


class StateSocket(_Guarded, websocket.WebSocketHandler):
    """One browser page: states go out, sticks and orders come in."""

    def check_origin(self, origin: str) -> bool:
        """True where the page that opens the socket is ours."""
        return urlsplit(origin).netloc == self.request.host

    def open(self, *args: str, **kwargs: str) -> None:
        """Count the page in."""
        self.shared.pages.add(self)
        self.sending = False
        self.set_nodelay(True)
        if self.shared.newest:
            self.offer(self.shared.newest)

    def on_close(self) -> None:
        """Count the page out; its sticks are let go."""
        self.shared.pages.discard(self)
        self.shared.console.gone(id(self))

    def on_message(self, message: str | bytes) -> None:
        """Take what the operator wants; what cannot be understood is left out."""
        try:
            said = json.loads(message)
            if isinstance(said, dict):
                self._take(said)
        except (ValueError, TypeError):
            return

    def offer(self, state: bytes) -> None:
        """Send a state, unless the page is still busy with the one before."""
        if self.sending:
            return
        self.sending = True
        try:
            sent = self.write_message(state)
        except websocket.WebSocketClosedError:
            self.shared.pages.discard(self)
            return
        sent.add_done_callback(self._sent)

    def _sent(self, sent: Any) -> None:
        self.sending = False
        if sent.exception() is not None:
            self.shared.pages.discard(self)

    def _take(self, said: dict[str, Any]) -> None:
        console = self.shared.console
        if "sticks" in said:
            forward, left, turn = _shares(said["sticks"], 3)
            console.sticks(id(self), (forward, left, turn))
        if "trunk" in said:
            roll, pitch, yaw, height = _shares(said["trunk"], 4)
            console.trunk((roll, pitch, yaw, height))
        if isinstance(said.get("gait"), str):
            console.gait(said["gait"])
        if isinstance(said.get("order"), str):
            console.order(said["order"])
        self._take_way(said)

    def _take_way(self, said: dict[str, Any]) -> None:
        console = self.shared.console
        if "waypoint" in said:
            forward, left = _shares(said["waypoint"], 2, _FARTHEST)
            console.waypoint(forward, left)
        if said.get("clear") is True:
            console.clear()
        if isinstance(said.get("task"), str):
            console.task(id(self), said["task"])


def _shares(values: Any, count: int, most: float = 1.0) -> list[float]:
    """Numbers in -most..most.

    Raises:
        ValueError: they are not as many numbers, or not finite.
    """
    if not isinstance(values, list):
        raise ValueError(values)
    shares = [float(value) for value in values]
    if len(shares) != count or not all(-most <= share <= most for share in shares):
        raise ValueError(values)
    return shares


class StationServer:
    """The server; runs in the event loop of whoever makes it.

    Args:
        html: the page.
        console: takes what pages say.
        host: address to listen on; any but loopback needs the token, which is drawn here.
        port: to listen on; None takes the first that is free.

    Raises:
        ConfigurationError: it cannot listen there.

    Attributes:
        url: address of the page, with the token where there is one.
    """

    def __init__(self, html: str, console: Console, host: str = LOOPBACK, port: int | None = None) -> None:
        token = "" if is_loopback(host) else secrets.token_urlsafe(24)
        self.shared = Shared(html=html, console=console, token=token)
        rules = [(r"/", Page, {"shared": self.shared}), (r"/link", StateSocket, {"shared": self.shared})]
        application = web.Application(
            rules, websocket_max_message_size=_LONGEST, websocket_ping_interval=2, log_function=_quiet
        )
        self._server = httpserver.HTTPServer(application)
        listening = _listen(host, PORTS if port is None else (port,))
        self._server.add_socket(listening)
        chosen = listening.getsockname()[1]
        everywhere = host in ("0.0.0.0", "::", "")
        shown = socket.gethostname() if everywhere else f"[{host}]" if ":" in host else host
        self.url = f"http://{shown}:{chosen}/" + (f"?token={token}" if token else "")

    @property
    def pages(self) -> int:
        """Number of pages that look on."""
        return len(self.shared.pages)

    def spread(self, state: dict[str, Any]) -> None:
        """Send a state to every page."""
        self.shared.newest = orjson.dumps(state, option=orjson.OPT_SERIALIZE_NUMPY)
        for page in tuple(self.shared.pages):
            page.offer(self.shared.newest)

    def close(self) -> None:
        """Stop listening, and let the pages go."""
        self._server.stop()
        for page in tuple(self.shared.pages):
            page.close()


def _listen(host: str, ports: Sequence[int]) -> socket.socket:
    problem: OSError | None = None
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    for port in ports:
        try:
            listening = socket.create_server((host, port), family=family)
        except OSError as error:
            problem = error
        else:
            listening.setblocking(False)
            return listening
    where = f"{host}, port {ports[0]}" + (f" to {ports[-1]}" if len(ports) > 1 else "")
    raise ConfigurationError(
        f"cannot serve the page on {where}: {problem}. Choose another --host or --page-port"
    )


def _quiet(handler: web.RequestHandler) -> None:
    """Requests are not worth a line each."""
