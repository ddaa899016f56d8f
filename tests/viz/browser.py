"""A real browser without a window, driven over Chromium's DevTools protocol."""

from __future__ import annotations

import asyncio
import base64
import json
import shutil
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Any

from tornado import websocket

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
START_TIMEOUT = 60.0  # s


def find_browser() -> str | None:
    """Path of a Chromium, or None."""
    return next(filter(None, (shutil.which(name) for name in NAMES)), None)


class Browser:
    """One page of a browser; everything happens in the loop of whoever awaits it.

    Args:
        window: width and height in pixels.
        webgl: draw 3D in software; slow, but a picture shows the robot.
    """

    def __init__(self, window: tuple[int, int] = (1440, 900), webgl: bool = False) -> None:
        path = find_browser()
        if path is None:
            raise RuntimeError(f"none of {', '.join(NAMES)} is installed")
        self._folder = tempfile.TemporaryDirectory(prefix="bluefoot-browser-", ignore_cleanup_errors=True)
        graphics = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
        self._process = subprocess.Popen(
            [
                path, "--headless", "--no-sandbox", "--remote-debugging-port=0", "--no-first-run",
                "--remote-allow-origins=*", "--disable-extensions", "--disable-background-networking",
                "--disable-dev-shm-usage", "--hide-scrollbars", f"--user-data-dir={self._folder.name}",
                f"--window-size={window[0]},{window[1]}", *(graphics if webgl else ["--disable-gpu"]),
                "about:blank",
            ],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        self._window = window
        self._number = 0
        self._connections: list[websocket.WebSocketClientConnection] = []
        self.complaints: list[str] = []

    async def open(self, url: str) -> None:
        """Go to an address in the browser's first page."""
        self._socket = await self._connect(self._debugger())
        targets = (await self.call("Target.getTargets"))["targetInfos"]
        page = next(target["targetId"] for target in targets if target["type"] == "page")
        address = self._debugger().rsplit("/devtools/", 1)[0] + f"/devtools/page/{page}"
        self._socket = await self._connect(address)
        await self.call("Runtime.enable")
        await self.call("Page.enable")
        width, height = self._window
        metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        await self.call("Emulation.setDeviceMetricsOverride", **metrics)
        await self.call("Page.navigate", url=url)

    async def _connect(self, address: str) -> websocket.WebSocketClientConnection:
        connection = await websocket.websocket_connect(address, max_message_size=1 << 28)
        self._connections.append(connection)
        return connection

    async def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """One command of the DevTools protocol, and its result."""
        self._number += 1
        number = self._number
        await self._socket.write_message(json.dumps({"id": number, "method": method, "params": parameters}))
        while True:
            text = await self._socket.read_message()
            if text is None:
                raise RuntimeError(f"the browser hung up during {method}")
            answer = json.loads(text)
            if answer.get("method") == "Runtime.exceptionThrown":
                self.complaints.append(json.dumps(answer["params"]["exceptionDetails"])[:500])
            if answer.get("id") == number:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']}")
                return answer["result"]

    async def value(self, expression: str) -> Any:
        """The value of a JavaScript expression."""
        result = await self.call("Runtime.evaluate", expression=expression, returnByValue=True)
        if "exceptionDetails" in result:
            raise RuntimeError(f"{expression}: {json.dumps(result['exceptionDetails'])[:500]}")
        return result["result"].get("value")

    async def wait_for(self, expression: str, timeout: float = 30.0) -> Any:
        """The first value of an expression that counts as true."""
        end = time.monotonic() + timeout
        while True:
            value = await self.value(expression)
            if value:
                return value
            if time.monotonic() > end:
                raise TimeoutError(f"{expression} is still {value!r} after {timeout:g} s")
            await asyncio.sleep(0.05)

    async def mouse(self, kind: str, x: float, y: float) -> None:
        """Press, move or release the left button at a place."""
        buttons = 0 if kind == "mouseReleased" else 1
        await self.call(
            "Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=buttons, clickCount=1
        )

    async def key(self, kind: str, key: str, code: int) -> None:
        """Press (``keyDown``) or release (``keyUp``) a key."""
        await self.call("Input.dispatchKeyEvent", type=kind, key=key, windowsVirtualKeyCode=code)

    async def centre(self, selector: str) -> tuple[float, float]:
        """The middle of an element, pixels."""
        box = await self.value(
            f"(() => {{ const b = document.querySelector({json.dumps(selector)}).getBoundingClientRect();"
            " return [b.x + b.width / 2, b.y + b.height / 2]; })()"
        )
        return box[0], box[1]

    async def click(self, selector: str) -> None:
        """Click on an element."""
        x, y = await self.centre(selector)
        await self.mouse("mousePressed", x, y)
        await self.mouse("mouseReleased", x, y)

    async def picture(self, path: Path) -> None:
        """Keep what is seen as a PNG."""
        data = (await self.call("Page.captureScreenshot", format="png"))["data"]
        path.write_bytes(base64.b64decode(data))

    async def leave(self) -> None:
        """Hang up, and end the browser."""
        for connection in self._connections:
            connection.close()
        await asyncio.sleep(0.1)
        self.close()
        # The browser has closed its ends; now ours learn of it.
        await asyncio.sleep(0.1)

    def close(self) -> None:
        """End the browser."""
        self._process.terminate()
        try:
            self._process.wait(timeout=10.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._folder.cleanup()

    def _debugger(self) -> str:
        """Address of the browser's debugger; the browser writes its port into a file once it listens."""
        file = Path(self._folder.name) / "DevToolsActivePort"
        end = time.monotonic() + START_TIMEOUT
        while time.monotonic() < end:
            if file.is_file() and len(lines := file.read_text().split()) == 2:
                return f"ws://127.0.0.1:{lines[0]}{lines[1]}"
            time.sleep(0.1)
        raise TimeoutError("the browser did not start")
