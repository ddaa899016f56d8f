"""What the robot itself is made of, as far as that can be tried without it."""

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.io.servo_robot.config import DevicesConfig
from bluefoot_mpc.scenarios import hardware

cv2 = pytest.importorskip("cv2")


class StoppedClock:
    """A clock that stands still."""

    def now(self):
        return 10.0

    def sleep_until(self, time):
        raise AssertionError("nobody waits here")


def picture_after(tmp_path, **config):
    """The first picture of a video of one frame, read at 10 s."""
    file = str(tmp_path / "video.avi")
    writer = cv2.VideoWriter(file, cv2.VideoWriter_fourcc(*"MJPG"), 10.0, (64, 48))
    writer.write(np.zeros((48, 64, 3), dtype=np.uint8))
    writer.release()
    camera = hardware.make_camera(DevicesConfig(camera=file, **config), StoppedClock())
    try:
        camera.start()
        return camera.take()
    finally:
        camera.close()


def test_pictures_are_stamped_with_their_exposure(tmp_path):
    assert picture_after(tmp_path, camera_delay=0.12).time == pytest.approx(9.88)
    assert picture_after(tmp_path).time == pytest.approx(9.93)


def test_no_camera_is_none():
    assert hardware.make_camera(DevicesConfig(), StoppedClock()) is None


@pytest.mark.parametrize("delay", [-0.01, 1.1, float("nan")])
def test_impossible_delays_are_refused(delay):
    with pytest.raises(ConfigurationError, match="camera_delay"):
        DevicesConfig(camera_delay=delay)
