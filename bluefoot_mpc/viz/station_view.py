"""What the station's page shows of the robot: numbers from telemetry, and the robot's body in 3D."""

from __future__ import annotations

import math
import time
from typing import Any

import numpy as np
import pinocchio as pin

from bluefoot_mpc.geometry import quaternion_from_rpy
from bluefoot_mpc.io.station.ground import LinkQuality
from bluefoot_mpc.io.station.picture import RobotPicture
from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.types import JOINTS, LEG_JOINTS, LEGS, FloatArray
from bluefoot_mpc.viz.animation import scene_data, viewer_script
from bluefoot_mpc.viz.page import embed_json, embed_script, render, template_text
from bluefoot_mpc.viz.scene import build_scene
from bluefoot_mpc.viz.style import LEG_COLOURS, LEG_NAMES

LINE_RATE = 57600
"""bit/s of the radio that the page counts the traffic against."""
_CONTACT_BITS = (1, 2, 4, 8)
_STANCE_BITS = 16
_TEXTS = 20


def station_page(robot: RobotModel) -> str:
    """The page, complete: it fetches nothing but the robot's state."""
    legs = [{"name": leg, "words": LEG_NAMES[leg], "colour": LEG_COLOURS[leg]} for leg in LEGS]
    facts = {
        "legs": legs,
        "joints": [name.replace("_", " ") for name in LEG_JOINTS],
        "lower": robot.lower,
        "upper": robot.upper,
    }
    return render(
        "station.html.j2",
        title="BlueFoot ground station",
        station_css=embed_script(template_text("station.css")),
        facts=embed_json(facts),
        run_data=embed_json(scene_data(build_scene(robot), robot.parameters.legs.foot_radius)),
        viewer_script=embed_script(viewer_script()),
        player_script=embed_script(template_text("player.js")),
        instruments_script=embed_script(template_text("station_instruments.js")),
        map_script=embed_script(template_text("station_map.js")),
        controls_script=embed_script(template_text("station_controls.js")),
        station_script=embed_script(template_text("station.js")),
    )


class StationView:
    """Makes the page's state out of what the station knows.

    Args:
        robot: the model, for feet that follow from joints.
    """

    def __init__(self, robot: RobotModel) -> None:
        self._robot = robot
        self._radius = robot.parameters.legs.foot_radius
        self._data = robot.pin_model.createData()
        self._rest = robot.default_stance()

    def state(self, picture: RobotPicture, quality: LinkQuality) -> dict[str, Any]:
        """One state, ready for JSON; numbers that do not exist are None."""
        q = self._configuration(picture)
        feet = self._feet(q)
        contact = [bool(value) for value in picture.contact]
        bits = sum(bit * (1 + _STANCE_BITS) for bit, on in zip(_CONTACT_BITS, contact, strict=True) if on)
        return {
            "time": _number(picture.time),
            "q": q,
            "feet": feet.ravel(),
            "states": bits,
            "rpy": _numbers(picture.rpy),
            "rates": _numbers(picture.rates),
            "position": _numbers(picture.position),
            "velocity": _numbers(picture.velocity),
            "joints": _numbers(picture.joints),
            "jointValid": picture.joint_valid.tolist(),
            "contact": contact,
            "contactValid": picture.contact_valid.tolist(),
            "temperatures": _numbers(picture.temperatures),
            "voltage": _number(picture.voltage),
            "load": _number(picture.load),
            "lateTicks": picture.late_ticks,
            "mode": picture.mode,
            "gait": picture.gait,
            "state": picture.state,
            "armed": picture.armed,
            "alarm": picture.alarm,
            "healthy": picture.healthy,
            "way": _way(picture),
            "texts": _texts(picture),
            "link": _link(quality),
        }

    def _configuration(self, picture: RobotPicture) -> FloatArray:
        """(23,) q of the robot; the default stance for what is not known yet."""
        q = self._rest.copy()
        if np.isfinite(picture.rpy).all():
            q[3:7] = quaternion_from_rpy(picture.rpy)
        joints = np.where(np.isfinite(picture.joints), picture.joints, q[7:])
        q[7 : 7 + len(JOINTS)] = joints
        if np.isfinite(picture.position).all():
            q[:3] = picture.position
        return q

    def _feet(self, q: FloatArray) -> FloatArray:
        """(4, 3) m, lowest points of the feet in the odometry frame."""
        pin.framesForwardKinematics(self._robot.pin_model, self._data, q)
        places = [self._data.oMf[number].translation for number in self._robot.foot_frame_ids]
        feet: FloatArray = np.array(places, dtype=np.float64) - np.array([0.0, 0.0, self._radius])
        return feet


def _way(picture: RobotPicture) -> dict[str, Any]:
    way = picture.way if picture.task else None
    marker = picture.way.marker if picture.way is not None else np.full(2, np.nan)
    return {
        "task": picture.task,
        "lead": "" if way is None else way.lead,
        "why": picture.why if way is not None else "",
        "clearance": None if way is None else _number(way.clearance),
        "marker": _numbers(marker),
        "markerAge": None if way is None else _number(way.marker_age),
    }


def _link(quality: LinkQuality) -> dict[str, Any]:
    share = 10.0 / LINE_RATE
    return {
        "age": _number(quality.age),
        "lossDown": quality.loss_down,
        "lossUp": quality.loss_up,
        "bad": quality.bad,
        "down": quality.bytes_down * share,
        "up": quality.bytes_up * share,
    }


def _texts(picture: RobotPicture) -> list[dict[str, Any]]:
    ahead = time.time() - time.monotonic()
    return [
        {
            "number": text.number,
            "clock": time.strftime("%H:%M:%S", time.localtime(text.time + ahead)),
            "severity": text.severity,
            "text": text.text,
        }
        for text in list(picture.texts)[-_TEXTS:]
    ]


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _numbers(values: FloatArray) -> list[float | None]:
    return [_number(value) for value in values.tolist()]
