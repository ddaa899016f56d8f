"""The robot live in a browser, while it runs."""

from __future__ import annotations

import logging
import threading
import time
from dataclasses import replace
from typing import Any, Protocol

import numpy as np

from bluefoot_mpc.geometry import rpy_from_quaternion
from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.types import LidarScan, SensorFrame, Telemetry, TruthSample
from bluefoot_mpc.viz.animation import player_script, scene_data, viewer_script
from bluefoot_mpc.viz.live_link import LiveLink
from bluefoot_mpc.viz.live_surroundings import LiveSurroundings
from bluefoot_mpc.viz.packing import pack
from bluefoot_mpc.viz.page import embed_json, embed_script, render, template_text
from bluefoot_mpc.viz.scene import build_scene
from bluefoot_mpc.viz.series import estimated_feet, estimated_q, from_virtual
from bluefoot_mpc.viz.stage import Stage, stage_data
from bluefoot_mpc.viz.stage_ground import LEAST_SPAN, colours
from bluefoot_mpc.viz.stage_motion import RAYS

_LOG = logging.getLogger(__name__)

RATE = 30.0
"""Hz, most pictures per second."""


class HasTelemetry(Protocol):
    """A controller's output, of which the view reads the telemetry."""

    @property
    def telemetry(self) -> Telemetry:
        """The controller's account of the tick."""
        ...


class LiveView:
    """Shows the robot in a browser page that is served on this machine only.

    `update` only leaves a note of the newest tick; a thread draws it, at most
    30 times a second, so a slow browser costs pictures and never ticks. Where
    the server cannot start, or dies, the run goes on unseen.

    Args:
        robot: the robot to draw.
        stage: what stands and moves around it.

    Attributes:
        url: address of the page; empty where there is none.
    """

    def __init__(self, robot: RobotModel, stage: Stage | None = None) -> None:
        self.url = ""
        self._radius = robot.parameters.legs.foot_radius
        stage = replace(stage or Stage(), foot_radius=self._radius)
        mounts = robot.parameters.sensors
        self._around = LiveSurroundings(stage, mounts.lidar, mounts.lidar_rotation)
        self._newest: tuple[Telemetry, TruthSample | None] | None = None
        self._wake = threading.Event()
        self._ending = False
        self._link: LiveLink | None = None
        self._thread: threading.Thread | None = None
        try:
            self._link = LiveLink(live_page(robot, stage))
        except OSError as error:
            _LOG.warning("no live view: %s", error)
            return
        self.url = self._link.url
        _LOG.info("live view at %s", self.url)
        self._thread = threading.Thread(target=self._draw, args=(self._link,), name="live view", daemon=True)
        self._thread.start()

    @property
    def alive(self) -> bool:
        """False where there is no server, or no longer."""
        return self._link is not None and self._link.alive

    @property
    def pages(self) -> int:
        """Number of browser pages that look on."""
        return self._link.pages if self._link is not None else 0

    def update(self, frame: SensorFrame, output: HasTelemetry, truth: TruthSample | None = None) -> None:
        """Show a tick: the simulator's truth where there is one, else the estimate; returns at once.

        Args:
            frame: the frame that the tick used.
            output: what the controller made of it.
            truth: the simulator's truth at the frame.
        """
        self.show(output.telemetry, truth, frame.lidar)

    def show(
        self, telemetry: Telemetry, truth: TruthSample | None = None, scan: LidarScan | None = None
    ) -> None:
        """Show a tick by its telemetry and its sweep; returns at once."""
        self._around.note(telemetry, truth, scan)
        self._newest = (telemetry, truth)
        self._wake.set()

    def close(self) -> None:
        """End the view and free its server. Idempotent."""
        self._ending = True
        self._wake.set()
        if self._thread is not None:
            self._thread.join(timeout=0.5)
        if self._link is not None:
            self._link.close()
        if self._thread is not None:
            # A write to a server that hangs ends when the server does.
            self._thread.join(timeout=2.0)
        self._thread = self._link = None

    def _draw(self, link: LiveLink) -> None:
        while not self._ending:
            self._wake.wait(timeout=0.5)
            self._wake.clear()
            if not link.alive:
                _LOG.warning("the live view's server is gone; the run goes on without it")
                return
            started = time.monotonic()
            newest, self._newest = self._newest, None
            if newest is not None:
                link.send(live_state(*newest) | self._around.state(*newest))
            time.sleep(max(0.0, 1.0 / RATE - (time.monotonic() - started)))


def live_page(robot: RobotModel, stage: Stage | None = None) -> str:
    """The page that draws a robot's states as they come.

    Args:
        robot: the robot to draw.
        stage: what stands and moves around it.
    """
    radius = robot.parameters.legs.foot_radius
    stage = replace(stage or Stage(), foot_radius=radius)
    data = scene_data(build_scene(robot), radius) | stage_data(stage)
    data["terrain"] = colours(LEAST_SPAN)
    # Sweeps come ready as points; the page only makes room for them.
    data["sweeps"] = {"mount": [0.0, 0.0, 0.0], "bearing": pack(np.zeros(RAYS))}
    return render(
        "live.html.j2",
        title=f"{robot.parameters.name}, live",
        has_truth=True,
        has_room=bool(data.get("bounds")),
        plots_follow=False,
        run_data=embed_json(data),
        viewer_script=embed_script(viewer_script()),
        player_script=embed_script(player_script()),
        live_script=embed_script(template_text("live.js")),
    )


def live_state(telemetry: Telemetry, truth: TruthSample | None) -> dict[str, Any]:
    """What the page needs to draw one tick; numbers that do not exist are None."""
    q = estimated_q(telemetry) if truth is None else truth.q
    feet = estimated_feet(telemetry) if truth is None else truth.foot_position
    stance = ~(telemetry.phase.swing & telemetry.phase.walking)
    yaw = np.array([rpy_from_quaternion(q[3:7])[2]])
    wanted = telemetry.reference.foot_position[None, :, :2]
    zmp = from_virtual(telemetry.zmp[None, None], wanted, feet[None, :, :2], stance[None], yaw)[0, 0]
    states = telemetry.estimate.contact @ [1, 2, 4, 8] + stance @ [16, 32, 64, 128]
    speed = telemetry.motion.velocity
    return {
        "time": telemetry.time,
        "q": q,
        "feet": feet.ravel(),
        "states": int(states),
        "com": None if truth is None else truth.com,
        "zmpPlan": zmp if np.isfinite(zmp).all() else None,
        "push": None if truth is None else truth.external_force,
        "mode": str(telemetry.mode),
        "gait": telemetry.motion.gait,
        "speed": [float(speed[0]), float(speed[1]), telemetry.motion.yaw_rate],
        "events": list(telemetry.events),
    }
