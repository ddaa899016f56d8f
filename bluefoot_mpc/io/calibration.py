"""How the counts of each servo relate to the angle of its joint, and whether that can still be trusted.

``count = 512 + offset + sign * angle / step``: the AX-12A's goal and present
position have 1024 counts over 300°, 512 in the middle (e-manual, address 30).
A horn sits on its shaft where it was screwed on, so offset and sign of a joint
are measured once (``bluefoot servo calibrate``) and kept in a TOML file.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.io.findings import Finding, Severity
from bluefoot_mpc.model.parameters import RobotParameters, load_parameters
from bluefoot_mpc.settings import build, dump_toml, read_toml, require_range, to_table
from bluefoot_mpc.types import JOINTS, LEG_JOINTS, N_JOINTS, FloatArray

MIDDLE = 512
"""Count of the servo's middle."""
HIGHEST = 1023
"""Highest count of the goal and position registers."""
STEP = math.radians(300.0) / HIGHEST
"""rad of one count (AX-12A e-manual: 300° from count 0 to 1023)."""
AX12_MODEL = 12
"""Model number (register 0) of an AX-12A."""
DEFAULT_FILE = Path("calibration.toml")
"""Where commands look for a calibration unless told otherwise."""

_MEND = "make the file anew with: bluefoot servo calibrate"


@dataclass(frozen=True, kw_only=True, slots=True)
class JointCalibration:
    """One joint and its servo."""

    name: str  # of the joint, e.g. "FL_hip_yaw"
    id: int  # of the servo, 0..253
    port: str = ""  # of its bus; empty where all servos share one
    sign: int = 1  # +1: counts rise with the angle
    offset: int = 0  # counts from the servo's middle to angle zero
    soft_limits_deg: tuple[float, float] = (-90.0, 90.0)  # degrees, no goal leaves them
    servo_model: int = AX12_MODEL  # register 0, as seen when it was calibrated
    firmware: int = 0  # register 2, as seen then; 0 = not known
    verified: bool = False  # a person saw that sign and offset are right

    def __post_init__(self) -> None:
        require_range(0, 253, id=self.id)
        require_range(0, 65535, servo_model=self.servo_model)
        require_range(0, 255, firmware=self.firmware)
        require_range(-MIDDLE, HIGHEST - MIDDLE, offset=self.offset)
        if self.sign not in (-1, 1):
            raise ConfigurationError(f"sign = {self.sign} must be 1 or -1")
        low, high = self.soft_limits_deg
        if not -180.0 <= low < high <= 180.0:
            raise ConfigurationError(
                f"soft_limits_deg = [{low:g}, {high:g}] must be rising and inside ±180 degrees"
            )

    @property
    def limit_counts(self) -> tuple[int, int]:
        """Lowest and highest count that the soft limits ask for; may lie outside 0..1023."""
        ends = [MIDDLE + self.offset + self.sign * math.radians(a) / STEP for a in self.soft_limits_deg]
        return math.floor(min(ends)), math.ceil(max(ends))


@dataclass(frozen=True, kw_only=True, slots=True)
class Calibration:
    """Signs, offsets, IDs and limits of all joints, and what they were made for.

    Attributes:
        model: name of the robot's parameter set.
        made: date and time (ISO 8601) of the calibration.
        setup: date and time of the last set-up that gave one of these servos its ID; empty = none since.
        depends: hash of what the calibration holds for; empty while it is made.
        joints: 16, in the order of `bluefoot_mpc.types.JOINTS`.
    """

    model: str
    made: str
    setup: str = ""
    depends: str = ""
    joints: tuple[JointCalibration, ...]
    _scale: FloatArray = field(init=False, repr=False, compare=False)  # counts per rad, signed
    _zero: FloatArray = field(init=False, repr=False, compare=False)  # counts at angle zero

    def __post_init__(self) -> None:
        names = tuple(joint.name for joint in self.joints)
        if names != JOINTS:
            wrong = next((n for n, w in zip(names, JOINTS, strict=False) if n != w), None)
            text = f"'{wrong}' is not where it belongs" if wrong else f"there are {len(names)}"
            raise ConfigurationError(f"joints: {text}; wanted are these 16 in order: {', '.join(JOINTS)}")
        for joint in self.joints:
            others = [o.name for o in self.joints if (o.port, o.id) == (joint.port, joint.id)]
            if len(others) > 1:
                raise ConfigurationError(f"joints: {' and '.join(others)} share the servo ID {joint.id}")
        _date("made", self.made)
        if self.setup:
            _date("setup", self.setup)
        object.__setattr__(self, "_scale", np.array([joint.sign / STEP for joint in self.joints]))
        zero = np.array([float(MIDDLE + joint.offset) for joint in self.joints])
        object.__setattr__(self, "_zero", zero)

    @classmethod
    def nominal(cls, parameters: RobotParameters | None = None) -> Calibration:
        """Every sign +1 and every offset 0, as the emulator has it; nothing was measured."""
        parameters = parameters or load_parameters()
        limits = parameters.legs.limits_deg
        joints = tuple(
            JointCalibration(
                name=name, id=index + 1, verified=True,
                soft_limits_deg=getattr(limits, LEG_JOINTS[index % len(LEG_JOINTS)]),
            )
            for index, name in enumerate(JOINTS)
        )  # fmt: skip
        return cls(model=parameters.name, made="2000-01-01T00:00:00+00:00", joints=joints).sealed()

    def counts(self, angles: ArrayLike) -> NDArray[np.int64]:
        """Goal counts for joint angles.

        Args:
            angles: (16,) rad, finite.

        Returns:
            (16,) counts, rounded to the nearest and clipped to the registers' 0..1023.
        """
        raw = np.floor(np.asarray(angles, dtype=np.float64) * self._scale + (self._zero + 0.5))
        return np.minimum(np.maximum(raw, 0.0), float(HIGHEST)).astype(np.int64)

    def angles(self, counts: ArrayLike) -> FloatArray:
        """Joint angles (16,) rad of measured counts (16,), never clipped; NaN stays NaN."""
        return (np.asarray(counts, dtype=np.float64) - self._zero) / self._scale

    @property
    def signs(self) -> FloatArray:
        """(16,) ±1: turns speeds and loads of servos into those of joints, and back."""
        return np.sign(self._scale)

    @property
    def offsets(self) -> FloatArray:
        """(16,) counts from the servo's middle to angle zero."""
        return self._zero - MIDDLE

    @property
    def ids(self) -> tuple[int, ...]:
        """IDs of the 16 servos in the order of joints."""
        return tuple(joint.id for joint in self.joints)

    @property
    def ports(self) -> tuple[str, ...]:
        """Port of each servo; empty strings where all share one."""
        return tuple(joint.port for joint in self.joints)

    @property
    def soft_limits(self) -> tuple[FloatArray, FloatArray]:
        """(16,) lowest and (16,) highest angle that may be asked for, rad."""
        table = np.radians([joint.soft_limits_deg for joint in self.joints])
        return table[:, 0].copy(), table[:, 1].copy()

    def dependence(self) -> str:
        """Hash of what the numbers hold for: the robot's name, and ID and model of every servo."""
        parts = [self.model, *([joint.name, joint.id, joint.servo_model] for joint in self.joints)]
        return hashlib.sha256(json.dumps(parts).encode()).hexdigest()[:16]

    def sealed(self) -> Calibration:
        """The same with the hash of what it depends on."""
        return dataclasses.replace(self, depends=self.dependence())

    def with_joint(self, index: int, **changes: object) -> Calibration:
        """The same with other values for one joint."""
        joints = list(self.joints)
        joints[index] = dataclasses.replace(joints[index], **changes)  # type: ignore[arg-type]
        return dataclasses.replace(self, joints=tuple(joints))


def load_calibration(path: Path | str) -> Calibration:
    """Read a calibration file.

    Raises:
        ConfigurationError: it is missing or a value is impossible; names the file, the key and the mend.
    """
    file = Path(path)
    if not file.is_file():
        raise ConfigurationError(f"no calibration file {file}; {_MEND} --out {file}")
    try:
        return build(Calibration, read_toml(file))
    except ConfigurationError as error:
        raise ConfigurationError(f"{file}: {error}; correct it, or {_MEND} --out {file}") from error


def save_calibration(calibration: Calibration, path: Path | str) -> None:
    """Write a calibration file, whole or not at all.

    Raises:
        ConfigurationError: the file cannot be written.
    """
    file = Path(path)
    text = "# BlueFoot: count = 512 + offset + sign * angle / (300 deg / 1023), made by: "
    text += "bluefoot servo calibrate\n" + dump_toml(to_table(calibration))
    part = file.with_name(file.name + ".part")
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        part.write_text(text, encoding="utf-8")
        part.replace(file)
    except OSError as error:
        raise ConfigurationError(f"cannot write {file}: {error.strerror or error}") from error


def now_text() -> str:
    """The present date and time as calibrations write it."""
    return datetime.now(UTC).isoformat(timespec="seconds")


def findings(
    calibration: Calibration, model: str, servos: Mapping[int, tuple[int, int]] | None = None
) -> tuple[Finding, ...]:
    """Whether a calibration holds for a robot; refusals where a goal could go the wrong way.

    Args:
        calibration: what was read.
        model: name of the parameter set that the robot runs with.
        servos: by ID, model number and firmware of the servos that answered;
            None where nobody asked them. Two servos of the same model and
            firmware cannot be told apart: the AX-12A has no serial number.
    """
    found = [*_whole(calibration, model)]
    for joint in calibration.joints:
        found += _of_joint(joint, None if servos is None else servos.get(joint.id))
    sound = Finding(part="calibration", text=f"made {calibration.made}, all joints verified")
    return tuple(found) or (sound,)


def _whole(calibration: Calibration, model: str) -> list[Finding]:
    """Findings that concern all joints."""
    found = []
    if calibration.model != model:
        text = f"made for the robot '{calibration.model}', this one is '{model}'"
        found.append(_refusal("calibration", text))
    if calibration.depends != calibration.dependence():
        text = "names, IDs or models in the file are not those that it was made for"
        found.append(_refusal("calibration", text))
    if calibration.setup and _date("setup", calibration.setup) > _date("made", calibration.made):
        text = f"stale: made {calibration.made}, servos were set up {calibration.setup}"
        found.append(_refusal("calibration", text))
    return found


def _of_joint(joint: JointCalibration, seen: tuple[int, int] | None) -> list[Finding]:
    """Findings on one joint; `seen` is its servo's model and firmware."""
    part = f"servo {joint.id} ({joint.name})"
    found = []
    if not joint.verified:
        found.append(_refusal(part, "its calibration was not verified"))
    if seen is not None and (seen[0] != joint.servo_model or (joint.firmware and seen[1] != joint.firmware)):
        text = (
            f"another servo than the calibrated one: model {seen[0]} firmware {seen[1]}, "
            f"not model {joint.servo_model} firmware {joint.firmware}"
        )
        found.append(_refusal(part, text))
    low, high = joint.limit_counts
    if low < 0 or high > HIGHEST:
        mend = "Turn the horn on its spline nearer to the middle and calibrate again"
        text = f"soft limits reach counts {low}..{high}, the servo has 0..{HIGHEST}"
        found.append(Finding(part=part, text=text, mend=mend, severity=Severity.WARNING))
    return found


def _refusal(part: str, text: str) -> Finding:
    mend = "Calibrate again: bluefoot servo calibrate"
    return Finding(part=part, text=text, mend=mend, severity=Severity.REFUSAL)


def _date(key: str, text: str) -> datetime:
    try:
        date = datetime.fromisoformat(text)
    except ValueError:
        example = "2026-01-31T12:00:00+00:00"
        raise ConfigurationError(f"{key} = '{text}' is not a date such as {example}") from None
    return date if date.tzinfo else date.replace(tzinfo=UTC)


def servo_ids() -> tuple[int, ...]:
    """IDs of a robot as it should be: 4·leg + joint + 1."""
    return tuple(range(1, N_JOINTS + 1))


def joint_of_id(servo: int) -> str:
    """Name of the joint that a servo ID belongs to, or ``"no joint"``."""
    return JOINTS[servo - 1] if 1 <= servo <= N_JOINTS else "no joint"
