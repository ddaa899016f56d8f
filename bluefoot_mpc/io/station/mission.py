"""The robot's side of MAVLink's mission protocol: a list of waypoints comes in, or goes out.

Waypoints are items MAV_CMD_NAV_WAYPOINT in MAV_FRAME_LOCAL_FLU: x forward and y
to the left of where the run started, 10 000 to the metre. The robot asks for one item
after the other and says so again while none comes; only a complete list takes
the place of the old one (MAVLink guide, "Mission Protocol").
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from pymavlink.dialects.v20 import common as mavlink

from bluefoot_mpc.io.station.config import StationConfig
from bluefoot_mpc.io.station.protocol import mission_result_name
from bluefoot_mpc.io.station.steps import REACH
from bluefoot_mpc.types import FloatArray

PER_METRE = 1e4
"""Units of x and y of a MISSION_ITEM_INT in a local frame."""
FRAME = int(mavlink.MAV_FRAME_LOCAL_FLU)
WAYPOINT = int(mavlink.MAV_CMD_NAV_WAYPOINT)
_LIST = int(mavlink.MAV_MISSION_TYPE_MISSION)
_EVERYTHING = int(mavlink.MAV_MISSION_TYPE_ALL)
_OK = int(mavlink.MAV_MISSION_ACCEPTED)
_REMEMBERED = 5.0
"""s for which an item that comes again after the end of its upload gets the same answer again."""
_PARAMETERS = (
    mavlink.MAV_MISSION_INVALID_PARAM1, mavlink.MAV_MISSION_INVALID_PARAM2,
    mavlink.MAV_MISSION_INVALID_PARAM3, mavlink.MAV_MISSION_INVALID_PARAM4,
)  # fmt: skip

Partner = tuple[int, int]
"""System and component of whoever is at the other end."""


@dataclass(slots=True)
class _Upload:
    """A list that comes in.

    Attributes:
        partner: who sends it.
        count: items that it has.
        points: those that have come.
        again: s, when the next one is asked for again.
        tries: how often it has been asked for.
    """

    partner: Partner
    count: int
    points: list[tuple[float, float]]
    again: float
    tries: int = 1


class MissionServer:
    """Takes and gives lists of waypoints.

    Args:
        config: how long and how often to ask, and for how many.
        get: the list that holds, (n, 2) m.
        put: takes a new one.
        tell: tells a person what was refused.
    """

    def __init__(
        self,
        config: StationConfig,
        get: Callable[[], FloatArray],
        put: Callable[[FloatArray], None],
        tell: Callable[[str], None],
    ) -> None:
        self._config, self._get, self._put, self._tell = config, get, put, tell
        self._upload: _Upload | None = None
        self._ended: tuple[Partner, int, float] = ((0, 0), _OK, -math.inf)

    def take(self, message: Any, now: float) -> list[Any]:
        """Take a message of the protocol that is addressed to this robot; gives the answers."""
        partner = (message.get_srcSystem(), message.get_srcComponent())
        take = _TAKE.get(message.get_type())
        return [] if take is None else take(self, message, partner, now)

    def due(self, now: float) -> Any:
        """What has to be said again now, or None."""
        upload = self._upload
        if upload is None or now < upload.again:
            return None
        if upload.tries >= self._config.mission_tries:
            have, count = len(upload.points), upload.count
            self._tell(f"waypoints: the upload broke off after {have} of {count}; the list is as it was")
            return self._end(int(mavlink.MAV_MISSION_OPERATION_CANCELLED), now)
        upload.tries += 1
        upload.again = now + self._config.mission_patience
        return self._request(upload)

    def wait(self, now: float) -> float:
        """Time (s) until something may have to be said again."""
        return math.inf if self._upload is None else max(0.0, self._upload.again - now)

    def _count(self, message: Any, partner: Partner, now: float) -> list[Any]:
        if message.mission_type != _LIST:
            return [_ack(partner, mavlink.MAV_MISSION_UNSUPPORTED, message.mission_type)]
        if self._upload is not None and self._upload.partner != partner:
            return [_ack(partner, mavlink.MAV_MISSION_DENIED)]
        most = self._config.waypoints_max
        if message.count > most:
            self._upload = None
            self._tell(f"waypoints: {message.count} are too many, at most {most}; the list is as it was")
            return [_ack(partner, mavlink.MAV_MISSION_NO_SPACE)]
        if message.count == 0:
            return self._clear(message, partner, now)
        self._upload = _Upload(partner, message.count, [], now + self._config.mission_patience)
        return [self._request(self._upload)]

    def _item(self, message: Any, partner: Partner, now: float) -> list[Any]:
        upload = self._upload
        if upload is None or upload.partner != partner:
            return [_ack(partner, self._refusal(partner, now))]
        if message.seq < len(upload.points):
            return []  # asked for twice, and both have come
        wrong = _wrong(message, len(upload.points))
        if wrong is not None:
            name = mission_result_name(wrong.result)
            self._tell(f"waypoint {message.seq + 1} refused ({name}): {wrong.why}; the list is as it was")
            return [self._end(wrong.result, now)]
        upload.points.append((message.x / PER_METRE, message.y / PER_METRE))
        upload.again, upload.tries = now + self._config.mission_patience, 1
        if len(upload.points) < upload.count:
            return [self._request(upload)]
        self._put(np.array(upload.points))
        return [self._end(_OK, now)]

    def _old_item(self, message: Any, partner: Partner, now: float) -> list[Any]:
        """MISSION_ITEM, whose places are not exact: MAVLink has given it up, and so does the robot."""
        if self._upload is None or self._upload.partner != partner:
            return []
        self._tell("waypoints refused: MISSION_ITEM came in place of MISSION_ITEM_INT; the list is as it was")
        return [self._end(int(mavlink.MAV_MISSION_UNSUPPORTED), now)]

    def _refusal(self, partner: Partner, now: float) -> int:
        """The answer to an item that nobody asked for: what came of its upload, where that has just ended."""
        if self._upload is not None:
            return int(mavlink.MAV_MISSION_DENIED)
        ended, result, when = self._ended
        recent = ended == partner and now - when < _REMEMBERED
        return result if recent else int(mavlink.MAV_MISSION_INVALID_SEQUENCE)

    def _cancelled(self, message: Any, partner: Partner, now: float) -> list[Any]:
        if self._upload is not None and self._upload.partner == partner and message.type != _OK:
            self._upload = None
        return []

    def _clear(self, message: Any, partner: Partner, now: float) -> list[Any]:
        kind = message.mission_type
        if kind not in (_LIST, _EVERYTHING):
            return [_ack(partner, mavlink.MAV_MISSION_UNSUPPORTED, kind)]
        if self._upload is not None and self._upload.partner != partner:
            return [_ack(partner, mavlink.MAV_MISSION_DENIED, kind)]
        self._upload = None
        self._put(np.zeros((0, 2)))
        return [_ack(partner, _OK, kind)]

    def _list(self, message: Any, partner: Partner, now: float) -> list[Any]:
        count = len(self._get()) if message.mission_type == _LIST else 0
        return [mavlink.MAVLink_mission_count_message(*partner, count, message.mission_type)]

    def _give(self, message: Any, partner: Partner, now: float) -> list[Any]:
        points = self._get()
        if message.mission_type != _LIST or not 0 <= message.seq < len(points):
            return [_ack(partner, mavlink.MAV_MISSION_INVALID_SEQUENCE, message.mission_type)]
        return [item(partner, message.seq, points[message.seq])]

    def _request(self, upload: _Upload) -> Any:
        return mavlink.MAVLink_mission_request_int_message(*upload.partner, len(upload.points), _LIST)

    def _end(self, result: int, now: float) -> Any:
        upload, self._upload = self._upload, None
        partner = upload.partner if upload is not None else (0, 0)
        self._ended = (partner, result, now)
        return _ack(partner, result)


_TAKE = {
    "MISSION_COUNT": MissionServer._count,
    "MISSION_ITEM_INT": MissionServer._item,
    "MISSION_ITEM": MissionServer._old_item,
    "MISSION_ACK": MissionServer._cancelled,
    "MISSION_CLEAR_ALL": MissionServer._clear,
    "MISSION_REQUEST_LIST": MissionServer._list,
    "MISSION_REQUEST_INT": MissionServer._give,
    "MISSION_REQUEST": MissionServer._give,
}


def item(partner: Partner, number: int, point: FloatArray) -> Any:
    """MISSION_ITEM_INT of a waypoint.

    Args:
        partner: who gets it.
        number: of the waypoint, from 0.
        point: (2,) m in the odometry frame.
    """
    x, y = (round(PER_METRE * value) for value in point.tolist())
    return mavlink.MAVLink_mission_item_int_message(
        *partner, number, FRAME, WAYPOINT, int(number == 0), 1, 0.0, 0.0, 0.0, 0.0, x, y, 0.0, _LIST
    )


class _Wrong(NamedTuple):
    """Why an item is refused.

    Attributes:
        result: MAV_MISSION_RESULT.
        why: in words.
    """

    result: int
    why: str


def _wrong(message: Any, number: int) -> _Wrong | None:
    """What is wrong with an item, or None; `number` is the one that was asked for."""
    params = (message.param1, message.param2, message.param3, message.param4)
    # A heading that is not asked for is 0 or NaN; nothing else means anything to this robot.
    odd = [value != 0.0 and not (place == 3 and math.isnan(value)) for place, value in enumerate(params)]
    far, beyond = PER_METRE * REACH, f"it lies more than {REACH:g} m away"
    checks = (
        (message.mission_type != _LIST, mavlink.MAV_MISSION_UNSUPPORTED, "only lists of waypoints are taken"),
        (message.seq != number, mavlink.MAV_MISSION_INVALID_SEQUENCE, f"number {number + 1} was asked for"),
        (message.frame != FRAME, mavlink.MAV_MISSION_UNSUPPORTED_FRAME, "it must be MAV_FRAME_LOCAL_FLU"),
        (message.command != WAYPOINT, mavlink.MAV_MISSION_UNSUPPORTED, "it must be MAV_CMD_NAV_WAYPOINT"),
        *((bad, result, "param1 to param4 must be 0") for bad, result in zip(odd, _PARAMETERS, strict=True)),
        (abs(message.x) > far, mavlink.MAV_MISSION_INVALID_PARAM5_X, beyond),
        (abs(message.y) > far, mavlink.MAV_MISSION_INVALID_PARAM6_Y, beyond),
        (message.z != 0.0, mavlink.MAV_MISSION_INVALID_PARAM7, "z must be 0: the robot stays on the ground"),
        (message.autocontinue != 1, mavlink.MAV_MISSION_INVALID, "autocontinue must be 1"),
    )
    return next((_Wrong(int(result), why) for bad, result, why in checks if bad), None)


def _ack(partner: Partner, result: int, kind: int = _LIST) -> Any:
    return mavlink.MAVLink_mission_ack_message(*partner, int(result), kind)
