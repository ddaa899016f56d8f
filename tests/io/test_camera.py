"""The camera's driver on video files that the test makes."""

import sys
import time

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.io.camera import Camera, CameraConfig, CameraError
from bluefoot_mpc.io.findings import Severity

cv2 = pytest.importorskip("cv2")

QUICK = CameraConfig(rate=100.0, retry=0.02, silence=0.3, delay=0.05)


@pytest.fixture(scope="module")
def video(tmp_path_factory):
    """Twenty red pictures, brighter one by one."""
    path = str(tmp_path_factory.mktemp("video") / "red.avi")
    writer = cv2.VideoWriter(path, cv2.VideoWriter_fourcc(*"MJPG"), 10.0, (64, 48))
    assert writer.isOpened()
    for number in range(20):
        picture = np.zeros((48, 64, 3), dtype=np.uint8)
        picture[:, :, 2] = 50 + 10 * number
        writer.write(picture)
    writer.release()
    return path


def wait_for(condition):
    end = time.monotonic() + 5.0
    while not condition():
        assert time.monotonic() < end, "nothing happened"
        time.sleep(0.005)


def test_pictures_are_rgb_stamped_and_new_once(video):
    camera = Camera(video, config=CameraConfig(rate=20.0, delay=0.05))
    camera.start()
    image = camera.take()
    now = time.monotonic()
    assert image.pixels.shape == (48, 64, 3)
    assert image.pixels.dtype == np.uint8
    red, green, blue = image.pixels.reshape(-1, 3).mean(axis=0)
    assert red > 40
    assert green < 15
    assert blue < 15
    assert image.valid
    assert 0.04 < now - image.time < 1.0
    taken = []
    wait_for(lambda: taken.append(camera.take()) or taken[-1] is not None)
    assert taken[-1].time > image.time
    with pytest.raises(ValueError, match="read-only"):
        image.pixels[0, 0, 0] = 1
    assert camera.findings()[0].severity is Severity.OK
    camera.close()
    camera.close()


def test_only_the_newest_is_kept(video):
    camera = Camera(video, config=QUICK)
    camera.start()
    wait_for(lambda: camera.pictures >= 15)
    assert camera.take().pixels[:, :, 0].mean() > 150
    assert camera.take() is None
    camera.close()


def test_the_end_of_a_file_is_a_fault_and_it_is_opened_again(video):
    camera = Camera(video, config=QUICK)
    camera.start()
    wait_for(lambda: camera.reconnects >= 1)
    wait_for(lambda: camera.pictures > 20)
    camera.close()


def test_a_looped_file_never_ends(video):
    camera = Camera(video, config=CameraConfig(rate=200.0, is_looped=True))
    camera.start()
    wait_for(lambda: camera.pictures > 45)
    assert camera.reconnects == 0
    assert not camera.fault
    camera.close()


def test_a_missing_camera_is_named_and_does_not_stop_anybody(tmp_path):
    camera = Camera(str(tmp_path / "none.avi"), config=QUICK)
    with pytest.raises(CameraError, match=r"none\.avi: cannot be opened\. Check its cable"):
        camera.start(timeout=0.2)
    assert camera.take() is None
    assert camera.findings()[0].severity is Severity.WARNING
    camera.close()
    assert not camera._thread.is_alive()


def test_a_camera_that_falls_silent_is_a_fault_and_its_picture_not_valid(video):
    camera = Camera(video, config=CameraConfig(rate=100.0, retry=60.0, silence=0.1))
    camera.start()
    wait_for(lambda: camera.fault == "the file has ended")
    time.sleep(0.15)
    image = camera.take()
    assert not image.valid
    assert camera.take() is None
    camera.close()


def test_opencv_is_loaded_only_when_a_camera_is_opened(monkeypatch):
    monkeypatch.setitem(sys.modules, "cv2", None)
    camera = Camera(0)
    assert camera.take() is None
    assert camera.fault == "not started"
    camera.close()


def test_a_number_may_be_text_and_opencv_keeps_quiet(capfd):
    camera = Camera("97", config=QUICK)
    with pytest.raises(CameraError, match="camera 97: cannot be opened"):
        camera.start(timeout=0.3)
    camera.close()
    assert "VIDEOIO" not in capfd.readouterr().err


def test_impossible_values_are_refused():
    with pytest.raises(ConfigurationError, match="rate"):
        CameraConfig(rate=0.0)
