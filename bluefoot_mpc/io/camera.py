"""The forward camera, through OpenCV: its own thread keeps the newest picture and nothing else.

OpenCV is imported when a camera is opened, not before.
"""

from __future__ import annotations

import importlib
import math
import threading
from dataclasses import dataclass
from typing import Any, Protocol

from bluefoot_mpc.exceptions import DeviceError
from bluefoot_mpc.io.clock import Clock, MonotonicClock
from bluefoot_mpc.io.findings import Finding, Severity
from bluefoot_mpc.settings import require_nonnegative, require_positive
from bluefoot_mpc.types import CameraImage


class CameraError(DeviceError):
    """The camera cannot be opened, or gives no pictures."""


@dataclass(frozen=True, kw_only=True, slots=True)
class CameraConfig:
    """How pictures are taken."""

    width: int = 640  # pixels, asked of the camera; it may give others
    height: int = 480  # pixels
    rate: float = 10.0  # pictures a second, at most
    delay: float = 0.0  # s from exposure to arrival, subtracted from the time stamp
    silence: float = 1.0  # s without a picture: the newest is not valid, the camera is opened anew
    retry: float = 1.0  # s between attempts to open it
    is_looped: bool = False  # a file begins anew at its end

    def __post_init__(self) -> None:
        require_positive(
            width=self.width, height=self.height, rate=self.rate, silence=self.silence, retry=self.retry
        )
        require_nonnegative(delay=self.delay)


class PictureSource(Protocol):
    """What a robot asks of its camera, real or emulated."""

    def open(self) -> None:
        """Begin to take pictures; returns at once."""
        ...

    def take(self) -> CameraImage | None:
        """The newest picture, if it is newer than at the last call; never waits."""
        ...

    def findings(self) -> tuple[Finding, ...]:
        """The camera's part of a check."""
        ...

    def close(self) -> None:
        """Give the camera back. Idempotent, never raises."""
        ...


class Camera:
    """Newest picture of a camera or a video file; nobody waits for it.

    Args:
        source: number of the camera (also as text), its path under /dev, or path of a video file.
        clock: clock of the time stamps; real time.
        config: how pictures are taken.

    Attributes:
        pictures: so far.
        reconnects: times that the camera was opened anew.
    """

    def __init__(
        self, source: int | str, clock: Clock | None = None, config: CameraConfig | None = None
    ) -> None:
        is_number = isinstance(source, str) and source.isdecimal()
        self._source = int(source) if is_number else source
        self._clock = clock or MonotonicClock()
        self._config = config or CameraConfig()
        self._newest: CameraImage | None = None
        self._is_new = False
        self._ended = threading.Event()
        self._arrived = threading.Condition()
        self._thread: threading.Thread | None = None
        self._trouble = "not started"
        self.pictures = 0
        self.reconnects = 0

    @property
    def name(self) -> str:
        """Of the camera, for messages."""
        return f"camera {self._source}"

    @property
    def fault(self) -> str:
        """What is wrong; empty while pictures come."""
        image = self._newest
        if self._trouble or image is None:
            return self._trouble
        age = self._clock.now() - image.time - self._config.delay
        return f"no picture for {age:.1f} s" if age > self._config.silence else ""

    def open(self) -> None:
        """Begin to take pictures; returns at once. What goes wrong stands in `fault`. Idempotent."""
        if self._thread is None:
            self._thread = threading.Thread(target=self._run, name="bluefoot camera", daemon=True)
            self._thread.start()

    def start(self, timeout: float = 3.0) -> None:
        """Open the camera and wait for the first picture.

        Args:
            timeout: s.

        Raises:
            CameraError: none came; the camera goes on being tried until `close`.
        """
        self.open()
        with self._arrived:
            if not self._arrived.wait_for(lambda: self.pictures > 0, timeout):
                mend = "Check its cable, or give another number or file"
                raise CameraError(f"{self.name}: {self.fault or 'gives no picture'}. {mend}")

    def take(self) -> CameraImage | None:
        """The newest picture, if it is newer than at the last call; never waits."""
        with self._arrived:
            if not self._is_new:
                return None
            self._is_new = False
            image = self._newest
        if image is None or self._clock.now() - image.time <= self._config.silence + self._config.delay:
            return image
        return CameraImage(time=image.time, pixels=image.pixels, valid=False)

    def findings(self) -> tuple[Finding, ...]:
        """The camera's part of a check; a robot can walk without it, so nothing here refuses."""
        if self.fault:
            mend = "Check its cable; without it the robot walks but sends no pictures"
            return (Finding(part=self.name, text=self.fault, mend=mend, severity=Severity.WARNING),)
        return (Finding(part=self.name, text=f"gives pictures ({self.pictures} so far)"),)

    def close(self) -> None:
        """End the thread and give the camera back. Idempotent, never raises."""
        self._ended.set()
        if self._thread is not None:
            self._thread.join(timeout=2.0)

    # -- the thread ---------------------------------------------------------------------

    def _run(self) -> None:
        cv2 = importlib.import_module("cv2")
        # What goes wrong stands in `fault`; OpenCV would print it again at every attempt.
        cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_ERROR)
        while not self._ended.is_set():
            capture = cv2.VideoCapture(self._source)
            try:
                self._record(cv2, capture)
            except cv2.error as error:
                self._trouble = f"OpenCV: {str(error).strip()}"
            finally:
                capture.release()
            if self._trouble and not self._ended.wait(self._config.retry):
                self.reconnects += 1

    def _record(self, cv2: Any, capture: Any) -> None:
        """Keep the newest picture until the camera gives none any more."""
        config = self._config
        if not capture.isOpened():
            self._trouble = "cannot be opened"
            return
        is_file = isinstance(self._source, str) and not self._source.startswith("/dev/")
        if not is_file:
            capture.set(cv2.CAP_PROP_FRAME_WIDTH, config.width)
            capture.set(cv2.CAP_PROP_FRAME_HEIGHT, config.height)
            # A queue in the driver would make every picture old.
            capture.set(cv2.CAP_PROP_BUFFERSIZE, 1)
        due = -math.inf
        while not self._ended.is_set():
            is_there, frame = capture.read()
            if not is_there:
                self._trouble = "the file has ended" if is_file and not config.is_looped else ""
                if not is_file:
                    self._trouble = "gives no pictures any more"
                return
            now = self._clock.now()
            if now < due and not is_file:
                continue
            due = max(due + 1.0 / config.rate, now)
            pixels = cv2.cvtColor(frame, cv2.COLOR_BGR2RGB)
            self._publish(CameraImage(time=now - config.delay, pixels=pixels, valid=True))
            if is_file:
                self._ended.wait(1.0 / config.rate)

    def _publish(self, image: CameraImage) -> None:
        image.pixels.flags.writeable = False
        with self._arrived:
            self._newest, self._is_new = image, True
            self.pictures += 1
            self._trouble = ""
            self._arrived.notify_all()
