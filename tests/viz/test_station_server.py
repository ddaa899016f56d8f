"""The station's page: who may open it, and what it says to the operator's side."""

import asyncio
import json

import pytest
from tornado import httpclient, websocket

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.viz.station_server import StationServer, is_loopback


class Console:
    """Writes down what pages say."""

    def __init__(self):
        self.said = []

    def sticks(self, page, values):
        self.said.append(("sticks", values))

    def trunk(self, values):
        self.said.append(("trunk", values))

    def gait(self, name):
        self.said.append(("gait", name))

    def order(self, name):
        self.said.append(("order", name))

    def task(self, page, name):
        self.said.append(("task", name))

    def waypoint(self, forward, left):
        self.said.append(("waypoint", (forward, left)))

    def clear(self):
        self.said.append(("clear",))

    def gone(self, page):
        self.said.append(("gone",))


def with_server(talk, **options):
    """Run a conversation with a server; gives what pages said."""
    console = Console()

    async def run():
        server = StationServer("<p>the page</p>", console, **options)
        try:
            await asyncio.wait_for(talk(server), 20.0)
            await asyncio.sleep(0.05)
        finally:
            server.close()

    asyncio.run(run())
    return console.said


async def fetch(url, **options):
    request = httpclient.HTTPRequest(url, **options)
    return await httpclient.AsyncHTTPClient().fetch(request, raise_error=False)


async def connect(server, origin="", **headers):
    url = server.url.replace("http", "ws", 1).replace("/?", "/link?")
    url = url if "/link" in url else url + "link"
    page = server.url.split("/?")[0].rstrip("/")
    request = httpclient.HTTPRequest(url, headers={"Origin": origin or page} | headers)
    return await websocket.websocket_connect(request)


def test_the_page_is_served_on_loopback_and_may_not_be_framed():
    async def talk(server):
        assert server.url.startswith("http://127.0.0.1:")
        answer = await fetch(server.url)
        assert answer.body == b"<p>the page</p>"
        assert answer.headers["X-Frame-Options"] == "DENY"
        assert answer.headers["Cache-Control"] == "no-store"
        policy = answer.headers["Content-Security-Policy"]
        assert "default-src 'none'" in policy
        assert "frame-ancestors 'none'" in policy

    with_server(talk)


def test_pages_say_what_they_want_and_see_the_robot():
    async def talk(server):
        page = await connect(server)
        for words in (
            {"sticks": [0.5, 0, -1]}, {"trunk": [0, 0.1, 0, 0]}, {"gait": "walk"}, {"order": "stop"},
            {"waypoint": [1.5, -2]}, {"task": "goto"}, {"clear": True},
        ):  # fmt: skip
            await page.write_message(json.dumps(words))
        await asyncio.sleep(0.05)
        assert server.pages == 1
        server.spread({"mode": "walk", "load": None})
        assert json.loads(await page.read_message()) == {"mode": "walk", "load": None}
        page.close()
        await asyncio.sleep(0.05)
        assert server.pages == 0

    said = with_server(talk)
    assert said == [
        ("sticks", (0.5, 0.0, -1.0)), ("trunk", (0.0, 0.1, 0.0, 0.0)), ("gait", "walk"), ("order", "stop"),
        ("waypoint", (1.5, -2.0)), ("task", "goto"), ("clear",), ("gone",),
    ]  # fmt: skip


@pytest.mark.parametrize(
    "words",
    [
        "no JSON", "[]", "{}", '{"sticks": [1, 2, 3]}', '{"sticks": [0, 0]}', '{"sticks": "abc"}',
        '{"sticks": [NaN, 0, 0]}', '{"sticks": null}', '{"order": 7}', '{"trunk": [0, 0, 0, {}]}',
        '{"waypoint": [1]}', '{"waypoint": [NaN, 0]}', '{"waypoint": [2000, 0]}', '{"waypoint": "12"}',
        '{"waypoint": 3}', '{"task": 1}', '{"clear": 1}', '{"clear": "yes"}',
    ],
)  # fmt: skip
def test_words_that_mean_nothing_do_nothing(words):
    async def talk(server):
        page = await connect(server)
        await page.write_message(words)
        await page.write_message('{"order": "sit"}')
        await asyncio.sleep(0.05)
        page.close()
        await asyncio.sleep(0.05)

    assert with_server(talk)[0] == ("order", "sit")


@pytest.mark.parametrize("origin", ["http://evil.example", "http://127.0.0.1:1", "null"])
def test_other_web_pages_cannot_drive_the_robot(origin):
    async def talk(server):
        with pytest.raises(httpclient.HTTPClientError, match="403"):
            await connect(server, origin)

    assert with_server(talk) == []


def test_a_foreign_name_for_this_machine_is_refused():
    async def talk(server):
        assert (await fetch(server.url, headers={"Host": "evil.example"})).code == 403
        with pytest.raises(httpclient.HTTPClientError, match="403"):
            await connect(server, "http://evil.example", Host="evil.example")

    assert with_server(talk) == []


def test_beyond_loopback_a_token_is_needed():
    async def talk(server):
        page, token = server.url.split("?token=")
        page = page.replace(page.split("//")[1].split(":")[0], "127.0.0.1")
        assert len(token) >= 30
        assert (await fetch(page)).code == 403
        wrong = token[:-1] + ("y" if token.endswith("x") else "x")
        assert (await fetch(f"{page}?token={wrong}")).code == 403
        assert (await fetch(f"{page}?token={token}")).code == 200
        socket, origin = page.replace("http", "ws", 1) + "link", page.rstrip("/")
        for bad in (socket, f"{socket}?token=x"):
            with pytest.raises(httpclient.HTTPClientError, match="403"):
                await websocket.websocket_connect(httpclient.HTTPRequest(bad, headers={"Origin": origin}))
        foreign = httpclient.HTTPRequest(f"{socket}?token={token}", headers={"Origin": "http://evil.example"})
        with pytest.raises(httpclient.HTTPClientError, match="403"):
            await websocket.websocket_connect(foreign)
        good = httpclient.HTTPRequest(f"{socket}?token={token}", headers={"Origin": origin})
        page = await websocket.websocket_connect(good)
        page.close()
        await asyncio.sleep(0.05)

    with_server(talk, host="0.0.0.0")


def test_every_server_has_a_token_of_its_own():
    tokens = []

    async def talk(server):
        tokens.append(server.shared.token)

    with_server(talk, host="0.0.0.0")
    with_server(talk, host="0.0.0.0")
    with_server(talk)
    assert tokens[0] != tokens[1]
    assert tokens[2] == ""


def test_a_port_in_use_is_refused_with_a_way_out():
    async def talk(server):
        port = int(server.url.rstrip("/").rsplit(":", 1)[1])
        with pytest.raises(ConfigurationError, match="--page-port"):
            StationServer("", Console(), port=port)

    with_server(talk)


def test_two_stations_take_different_ports():
    async def talk(server):
        other = StationServer("", Console())
        assert other.url != server.url
        other.close()

    with_server(talk)


@pytest.mark.parametrize(
    ("host", "inside"),
    [
        ("127.0.0.1", True), ("localhost", True), ("::1", True), ("127.8.8.8", True),
        ("0.0.0.0", False), ("192.168.1.5", False), ("robot", False), ("", False),
    ],
)  # fmt: skip
def test_loopback_is_this_machine_only(host, inside):
    assert is_loopback(host) is inside
