"""The camera of an emulated robot: pictures of the simulated world, on the robot's clock."""

from __future__ import annotations

from bluefoot_mpc.io.camera import CameraError
from bluefoot_mpc.io.clock import Clock
from bluefoot_mpc.io.findings import Finding, Severity
from bluefoot_mpc.sim.plant import SimPlant
from bluefoot_mpc.types import CameraImage

_LOOK = 0.01
"""s between two looks of who waits for the first picture."""


class EmulatedCamera:
    """What `bluefoot_mpc.io.camera.Camera` is for a real camera, with the simulated body behind it.

    Args:
        plant: the body, with a camera in its configuration.
        clock: the robot's, which the plant follows.

    Attributes:
        name: of the camera, for messages.
        pictures: taken so far.
    """

    def __init__(self, plant: SimPlant, clock: Clock) -> None:
        self._plant, self._clock = plant, clock
        self._newest: CameraImage | None = None
        self._trouble = "not started"
        self.name = "emulated camera"
        self.pictures = 0

    @property
    def fault(self) -> str:
        """What is wrong; empty while pictures come."""
        return self._trouble

    def open(self) -> None:
        """Begin to take pictures; what came before is not kept. Idempotent."""
        if self._trouble == "not started":
            self._look()
            self._newest, self._trouble, self.pictures = None, "", 0

    def start(self, timeout: float = 3.0) -> None:
        """Open the camera and wait for the first picture, on the robot's clock.

        Args:
            timeout: s.

        Raises:
            CameraError: none came.
        """
        self.open()
        end = self._clock.now() + timeout
        while not self._trouble and self._newest is None and self._clock.now() < end:
            self._clock.sleep_until(min(end, self._clock.now() + _LOOK))
            self._look()
        if self._newest is None:
            raise CameraError(f"{self.name}: {self.fault or 'gives no picture'}. Give it more time")

    def take(self) -> CameraImage | None:
        """The newest picture, if it is newer than at the last call; never waits."""
        if self._trouble:
            return None
        self._look()
        image, self._newest = self._newest, None
        return image

    def findings(self) -> tuple[Finding, ...]:
        """The camera's part of a check."""
        if self.fault:
            mend = "Without it the robot walks but sends no pictures"
            return (Finding(part=self.name, text=self.fault, mend=mend, severity=Severity.WARNING),)
        return (Finding(part=self.name, text=f"gives pictures ({self.pictures} so far)"),)

    def close(self) -> None:
        """Take no more pictures. Idempotent."""
        self._trouble = "closed"
        self._plant.close()

    def _look(self) -> None:
        self._plant.advance(self._clock.now())
        image = self._plant.picture()
        if image is not None:
            self._newest = image
            self.pictures += 1
