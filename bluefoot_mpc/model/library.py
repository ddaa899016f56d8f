"""Other quadrupeds, as ``example-robot-data`` publishes them: URDF, named feet, a standing posture.

They are no part of BlueFoot. They show that the model and the whole-body controller
know nothing of a particular robot.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pinocchio as pin

from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError
from bluefoot_mpc.model.parameters import GRAVITY
from bluefoot_mpc.settings import require_positive
from bluefoot_mpc.types import FloatArray


@dataclass(frozen=True, kw_only=True, slots=True)
class LibraryEntry:
    """Where a robot lies in the library, and what its files do not say."""

    urdf: str  # file, from the library's folder
    srdf: str  # file with the posture
    feet: tuple[str, ...]  # frames at the feet, front left, front right, hind left, hind right
    posture: str = "standing"  # group state of the SRDF
    foot_radius: float  # m, of a ball around the foot's frame

    def __post_init__(self) -> None:
        require_positive(foot_radius=self.foot_radius)
        if not self.feet:
            raise ConfigurationError(f"{self.urdf}: name at least one frame at a foot")


LIBRARY: dict[str, LibraryEntry] = {
    "solo12": LibraryEntry(
        urdf="solo_description/robots/solo12.urdf",
        srdf="solo_description/srdf/solo.srdf",
        feet=("FL_FOOT", "FR_FOOT", "HL_FOOT", "HR_FOOT"),
        foot_radius=0.015,
    ),
    "go2": LibraryEntry(
        urdf="go2_description/urdf/go2.urdf",
        srdf="go2_description/srdf/go2.srdf",
        feet=("FL_foot", "FR_foot", "RL_foot", "RR_foot"),
        foot_radius=0.022,
    ),
    "anymal": LibraryEntry(
        urdf="anymal_b_simple_description/robots/anymal.urdf",
        srdf="anymal_b_simple_description/srdf/anymal.srdf",
        feet=("LF_FOOT", "RF_FOOT", "LH_FOOT", "RH_FOOT"),
        foot_radius=0.031,
    ),
}
"""Robots by name. Radii: what each URDF's collision shape has, Solo12's mesh rounded."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class LibraryRobot:
    """A robot of the library, read.

    Attributes:
        name: what it is called here.
        urdf: its file.
        pin_model: Pinocchio model with a free flyer and the house's gravity.
        feet: names of the frames at its feet.
        foot_radius: m, of the ball around each.
        posture: (nq,) standing, the balls' lowest points on the ground z = 0.
    """

    name: str
    urdf: Path
    pin_model: pin.Model
    feet: tuple[str, ...]
    foot_radius: float
    posture: FloatArray

    @property
    def height(self) -> float:
        """m, centre of mass over the ground in the standing posture."""
        model = self.pin_model
        return float(pin.centerOfMass(model, model.createData(), self.posture)[2])


def library_folder() -> Path:
    """Where ``example-robot-data`` keeps its robots: beside Pinocchio's own files.

    Raises:
        ConfigurationError: it is not installed.
    """
    folder = Path(pin.__file__).parents[4] / "share" / "example-robot-data" / "robots"
    if not folder.is_dir():
        raise ConfigurationError(
            f"the robots of example-robot-data are not installed (no folder {folder}): "
            "pip install 'bluefoot-mpc[robots]'"
        )
    return folder


def load_library_robot(name: str, entry: LibraryEntry | None = None) -> LibraryRobot:
    """Read a robot of the library.

    Args:
        name: of `LIBRARY`, or any name for an entry given.
        entry: another robot of the folder.

    Raises:
        UnknownNameError: no robot has that name.
        ConfigurationError: the library is not installed, or lacks a file, a foot or the posture.
    """
    if entry is None:
        if name not in LIBRARY:
            raise UnknownNameError("robot", name, LIBRARY)
        entry = LIBRARY[name]
    folder = library_folder()
    urdf, srdf = (_existing(folder / file, name) for file in (entry.urdf, entry.srdf))
    model = pin.buildModelFromUrdf(str(urdf), pin.JointModelFreeFlyer())
    model.gravity.linear = np.array([0.0, 0.0, -GRAVITY])
    missing = [foot for foot in entry.feet if not model.existFrame(foot)]
    if missing:
        raise ConfigurationError(
            f"robot '{name}' has no frame {', '.join(map(repr, missing))} for a foot; "
            f"frames of its links: {', '.join(_links(model))}"
        )
    return LibraryRobot(
        name=name, urdf=urdf, pin_model=model, feet=entry.feet, foot_radius=entry.foot_radius,
        posture=_standing(model, srdf, entry),
    )  # fmt: skip


def _existing(path: Path, name: str) -> Path:
    if not path.is_file():
        raise ConfigurationError(
            f"robot '{name}': example-robot-data has no file {path}; another version of it is installed "
            "than 6.0, which the extra 'robots' asks for"
        )
    return path


def _links(model: pin.Model) -> list[str]:
    return sorted(frame.name for frame in model.frames if frame.type == pin.FrameType.BODY)


def _standing(model: pin.Model, srdf: Path, entry: LibraryEntry) -> FloatArray:
    """(nq,) the SRDF's posture, trunk level, at a height where the feet's balls touch the ground."""
    pin.loadReferenceConfigurations(model, str(srdf), False)
    known = {item.key(): item.data() for item in model.referenceConfigurations}
    if entry.posture not in known:
        raise ConfigurationError(
            f"{srdf.name} has no posture '{entry.posture}'; it has: {', '.join(sorted(known)) or 'none'}"
        )
    q = np.array(pin.neutral(model))
    q[7:] = known[entry.posture][7:]
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    lowest = min(float(data.oMf[model.getFrameId(foot)].translation[2]) for foot in entry.feet)
    q[2] = entry.foot_radius - lowest
    return q
