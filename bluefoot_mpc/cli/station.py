"""``bluefoot station``: the ground's end of a robot's radio."""

from __future__ import annotations

import asyncio
import contextlib
import signal
import sys
import time
from dataclasses import dataclass
from pathlib import Path

from bluefoot_mpc.cli import teleop as teleop_module
from bluefoot_mpc.cli.gamepad import Gamepad
from bluefoot_mpc.cli.outcome import INTERRUPTED, OK, Outcome
from bluefoot_mpc.cli.station_arguments import StationCommand
from bluefoot_mpc.cli.station_child import RobotProcess
from bluefoot_mpc.cli.station_operator import HELP, Operator
from bluefoot_mpc.cli.teleop import Teleop, TeleopConfig
from bluefoot_mpc.cli.terminal import Keyboard, raw_terminal
from bluefoot_mpc.io.station.ground import GroundLink, OperatorLog
from bluefoot_mpc.io.station.orders import Order
from bluefoot_mpc.model.robot import load_robot
from bluefoot_mpc.viz.station_server import StationServer
from bluefoot_mpc.viz.station_view import StationView, station_page

PERIOD = 0.04
"""s between two looks at keys, sticks and pages: as often as sticks are sent."""
STATUS_PERIOD = 0.2
"""s between two status lines."""


@dataclass(kw_only=True, slots=True)
class Station:
    """Everything that a running station consists of.

    Attributes:
        link: the robot.
        operator: what people want of it.
        view: makes the page's states.
        server: of the page, where there is one.
        robot: the program of a robot that was started here.
        screen: True where a terminal takes a status line.
        interrupted: True after Ctrl-C.
    """

    link: GroundLink
    operator: Operator
    view: StationView
    server: StationServer | None = None
    robot: RobotProcess | None = None
    screen: bool = False
    interrupted: bool = False
    _next_status: float = 0.0
    _robot_ran: bool = True

    async def run(self) -> None:
        """Serve until the operator ends it."""
        loop = asyncio.get_running_loop()
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            loop.add_signal_handler(number, self._interrupt)
        due = loop.time()
        while not (self.operator.ended or self.interrupted):
            self.turn()
            due = max(due + PERIOD, loop.time())
            await asyncio.sleep(due - loop.time())
        self.link.ask(Order.HALT)
        await asyncio.sleep(0.1)

    def turn(self) -> None:
        """Look at everything once: keys, sticks, the robot, the pages."""
        self.operator.update()
        self._watch_robot()
        if self.server is not None and self.server.pages:
            quality = self.link.quality()
            state = self.link.look(lambda picture: self.view.state(picture, quality))
            self.server.spread(state | {"operator": self.operator.account()})
        if self.screen:
            self._status()

    def _watch_robot(self) -> None:
        """A robot of our own that has ended is told, and starts again when it is to be armed."""
        if self.robot is None or self.robot.running:
            self._robot_ran = True
            return
        if self._robot_ran:
            self._robot_ran = False
            why = self.robot.last_words()
            self.link.tell(f"the robot's program has ended; Arm starts it again. {why}".strip(), fault=True)
        elif self.link.result() in (("arm", ""), ("arm", "no answer")):
            self.link.tell("starting the robot's program")
            self.robot.start()

    def _status(self) -> None:
        now = self.link.clock.now()
        if now < self._next_status:
            return
        self._next_status = now + STATUS_PERIOD
        mode, state, volts = self.link.look(lambda p: (p.mode, p.state, p.voltage))
        age = self.link.quality().age
        heard = f"{mode or '?'} {state} {volts:.1f} V" if age < 1.5 else "NO TELEMETRY"
        order, result = self.link.result()
        asked = f"  {order}: {result or '...'}" if order else ""
        sys.stderr.write(f"\r\x1b[K{self.operator.status()}  |  robot: {heard}{asked}")
        sys.stderr.flush()

    def _interrupt(self) -> None:
        self.interrupted = True


def station(command: StationCommand) -> Outcome:
    """Serve page and keyboard until the operator ends it; the log is named at the end."""
    log = OperatorLog(command.log or _folder() / "operator.jsonl")
    with contextlib.ExitStack() as stack:
        link = stack.enter_context(GroundLink(command.address, log=log))
        gamepad = Gamepad(command.gamepad)
        stack.callback(gamepad.close)
        found = gamepad.open()
        keyboard = Keyboard(stack.enter_context(raw_terminal())) if sys.stdin.isatty() else None
        teleop = Teleop(TeleopConfig(timeout=command.timeout))
        operator = Operator(link, teleop, keyboard, gamepad if found else None)
        robot = None
        if command.robot != "none":
            robot = RobotProcess(command, log.path.parent)
            stack.callback(robot.end)
        interrupted = asyncio.run(_serve(command, link, operator, robot, keyboard is not None))
        sys.stderr.write("\r\x1b[K" if keyboard is not None else "")
    data = {"log": log.path, "lines": log.lines, "exit_status": INTERRUPTED if interrupted else OK}
    page: tuple[str, ...] = (f"operator's log  {log.path} ({log.lines} lines)",)
    if robot is not None:
        data["robot"] = robot.folder
        page = (*page, f"robot's run     {robot.folder}")
    return Outcome(status=INTERRUPTED if interrupted else OK, data=data, page=page)


async def _serve(
    command: StationCommand, link: GroundLink, operator: Operator, robot: RobotProcess | None, screen: bool
) -> bool:
    model = load_robot()
    server = None
    if not command.no_page:
        server = StationServer(station_page(model), operator, command.host, command.page_port)
    serving = Station(
        link=link, operator=operator, view=StationView(model), server=server, robot=robot, screen=screen
    )
    _greet(link, server, screen, robot is not None)
    try:
        await serving.run()
    finally:
        if server is not None:
            server.close()
    return serving.interrupted


def _greet(link: GroundLink, server: StationServer | None, keyboard: bool, own_robot: bool) -> None:
    lines = [f"page      {server.url}"] if server is not None else []
    hint = "" if own_robot else "  (start it with: bluefoot run remote --station ADDRESS)"
    lines.append(f"robot     {link.name}{hint}")
    if keyboard:
        lines += [teleop_module.HELP, HELP]
    sys.stderr.write("\n".join(lines) + "\n")
    sys.stderr.flush()


def _folder() -> Path:
    return Path("runs") / f"{time.strftime('%Y%m%d-%H%M%S')}-station"
