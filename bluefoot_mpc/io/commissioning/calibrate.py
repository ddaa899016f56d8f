"""Finding offsets and signs: the robot limp in a known pose, then joint by joint moved by hand.

No servo has torque meanwhile. A joint that is turned must be the one whose
count changes; another one changing means that IDs are mixed up.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from bluefoot_mpc.exceptions import DeviceError
from bluefoot_mpc.io.calibration import MIDDLE, STEP, Calibration, now_text
from bluefoot_mpc.io.commissioning.ports import ServoPorts
from bluefoot_mpc.io.commissioning.pose import Pose
from bluefoot_mpc.io.commissioning.setup import bus_of
from bluefoot_mpc.io.commissioning.survey import Survey
from bluefoot_mpc.types import JOINTS, N_JOINTS, FloatArray

SAMPLES = 9
"""Readings of each servo; their median counts."""
STEADY = 3.0
"""Counts by which readings of a joint at rest may differ."""
LEAST_TURN = 12.0
"""Counts (3.5°) that a joint must be turned by hand to tell its direction."""
_TRIES = 3


class Dialog(Protocol):
    """The person at the robot."""

    def say(self, text: str) -> None:
        """Show a text."""
        ...

    def wait(self, text: str) -> None:
        """Show what to do and wait until it is done."""
        ...

    def confirm(self, text: str) -> bool:
        """Ask a question that is answered with yes or no."""
        ...


@dataclass(frozen=True, kw_only=True, slots=True)
class JointCheck:
    """What turning a joint by hand showed.

    Attributes:
        joint: index, 0..15.
        sign: +1 where counts rise with the angle.
        verified: the person agreed.
    """

    joint: int
    sign: int
    verified: bool


def read_counts(ports: ServoPorts, ids: Sequence[int]) -> FloatArray:
    """(n,) counts, median of several readings of each servo.

    Raises:
        ServoError: a servo does not answer.
        DeviceError: a joint does not hold still.
    """
    table = np.empty((SAMPLES, len(ids)))
    buses = [bus_of(ports, servo) for servo in ids]
    for row in table:
        row[:] = [bus.read(servo, "present_position") for bus, servo in zip(buses, ids, strict=True)]
    moving = np.flatnonzero(np.ptp(table, axis=0) > STEADY)
    if len(moving):
        names = ", ".join(f"servo {ids[k]} ({np.ptp(table[:, k]):.0f} counts)" for k in moving.tolist())
        raise DeviceError(f"moves while it is read: {names}. Hold the robot still, then calibrate again")
    return np.asarray(np.median(table, axis=0))


def posed(
    base: Calibration, found: Survey, counts: FloatArray, pose: Pose, signs: Sequence[int]
) -> Calibration:
    """The calibration that makes the counts the angles of a pose.

    Args:
        base: names, limits and IDs of the joints.
        found: the servos as they are, for model and firmware.
        counts: (16,) readings in the pose.
        pose: the angles there.
        signs: 16 of ±1.
    """
    raw = np.round(counts - MIDDLE - np.asarray(signs) * pose.joints / STEP)
    joints = []
    several = len({facts.port for facts in found.servos.values()}) > 1
    for index, joint in enumerate(base.joints):
        facts = found.servos[joint.id]
        joints.append(
            dataclasses.replace(
                joint, sign=int(signs[index]), offset=int(raw[index]), verified=False,
                port=facts.port if several else "",
                servo_model=facts["model_number"], firmware=facts["firmware_version"],
            )
        )  # fmt: skip
    return dataclasses.replace(base, made=now_text(), setup="", joints=tuple(joints)).sealed()


def check_joints(
    ports: ServoPorts, calibration: Calibration, directions: Mapping[int, str], dialog: Dialog
) -> tuple[JointCheck, ...]:
    """Have every joint named in `directions` turned by hand, one after the other.

    Args:
        ports: where the servos hang.
        calibration: IDs, offsets and the signs so far.
        directions: in words, which way angles grow, by joint.
        dialog: the person.

    Raises:
        DeviceError: a joint is never turned, or another one turns instead.
    """
    return tuple(_check_joint(ports, calibration, joint, text, dialog) for joint, text in directions.items())


def with_checks(calibration: Calibration, checks: Sequence[JointCheck], pose: Pose) -> Calibration:
    """The calibration with the signs that were seen; an offset of a bent pose follows its sign."""
    for check in checks:
        joint = calibration.joints[check.joint]
        bend = pose.joints[check.joint] / STEP
        offset = round(joint.offset + (joint.sign - check.sign) * bend)
        calibration = calibration.with_joint(
            check.joint, sign=check.sign, offset=offset, verified=check.verified
        )
    return calibration.sealed()


def _check_joint(
    ports: ServoPorts, calibration: Calibration, joint: int, direction: str, dialog: Dialog
) -> JointCheck:
    ids = calibration.ids
    name = JOINTS[joint]
    for _ in range(_TRIES):
        before = read_counts(ports, ids)
        dialog.wait(f"{name} (servo {ids[joint]}): {direction}, by 10 to 20 degrees, and hold it there")
        turned = read_counts(ports, ids) - before
        most = int(np.argmax(np.abs(turned)))
        if abs(turned[most]) < LEAST_TURN:
            dialog.say(f"no joint turned by more than {abs(turned[most]) * np.degrees(STEP):.1f}°: once more")
            continue
        if most != joint:
            raise DeviceError(
                f"servo {ids[most]} ({JOINTS[most]}) turned instead of servo {ids[joint]} ({name}): "
                "IDs are mixed up, or the wrong joint was turned. Check with: bluefoot servo scan"
            )
        sign = 1 if turned[joint] > 0.0 else -1
        angle = np.degrees(abs(turned[joint]) * STEP)
        said = dialog.confirm(
            f"{name}: turned by +{angle:.1f}°, counts {'rise' if sign > 0 else 'fall'}. Right?"
        )
        return JointCheck(joint=joint, sign=sign, verified=said)
    raise DeviceError(
        f"servo {ids[joint]} ({name}) did not turn in {_TRIES} tries: nothing was stored. "
        "Check that the horn is screwed to its shaft"
    )


def untouched(calibration: Calibration) -> tuple[str, ...]:
    """Names of joints that nobody has verified."""
    return tuple(joint.name for joint in calibration.joints[:N_JOINTS] if not joint.verified)
