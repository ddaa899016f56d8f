import os
import subprocess
import sys

import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.sim import graphics
from tests.graphics import needs_graphics

DRAW = """
import os, sys
from bluefoot_mpc.sim import graphics
if {egl_is_missing}:
    graphics._EGL_NAMES = ("libnowhere.so",)
from bluefoot_mpc.model.robot import load_robot
from bluefoot_mpc.sim.config import SimConfig
from bluefoot_mpc.sim.robot import SimRobot
from bluefoot_mpc.sim.sight_config import CameraConfig
early = {{name for name in sys.modules if name == "cv2" or name.startswith("OpenGL")}}
assert "MUJOCO_GL" in os.environ or not early, early
robot = SimRobot(load_robot(), SimConfig(camera=CameraConfig(enabled=True), settle_time=0.02))
print(robot._sight._camera.look().std() > 5.0, [n for n in ("egl", "osmesa") if "mujoco." + n in sys.modules])
"""


def drawn_by(egl_is_missing=False, **environment):
    """What another process draws with: PyOpenGL keeps to the first library that it meets."""
    kept = {name: value for name, value in os.environ.items() if name not in ("MUJOCO_GL", "DISPLAY")}
    done = subprocess.run(
        [sys.executable, "-c", DRAW.format(egl_is_missing=egl_is_missing)],
        env=kept | environment, capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "Exception ignored" not in done.stderr
    return done.stdout.strip()


@needs_graphics
def test_no_display_and_no_choice_will_do():
    assert drawn_by() in ("True ['egl']", "True ['osmesa']")


@pytest.mark.skipif(graphics._loads(graphics._OSMESA_NAMES) is None, reason="libosmesa6 is not installed")
def test_osmesa_takes_over_where_egl_is_missing():
    assert drawn_by(egl_is_missing=True) == "True ['osmesa']"


@pytest.mark.skipif(graphics._loads(graphics._OSMESA_NAMES) is None, reason="libosmesa6 is not installed")
def test_the_choice_is_the_users():
    assert drawn_by(MUJOCO_GL="osmesa") == "True ['osmesa']"


@pytest.fixture
def bare_machine(monkeypatch):
    monkeypatch.delenv(graphics.VARIABLE, raising=False)
    monkeypatch.setattr(graphics, "_EGL_NAMES", ("libnowhere.so",))
    monkeypatch.setattr(graphics, "_OSMESA_NAMES", ("libnowhere.so",))


def test_a_machine_that_cannot_draw_is_told_what_to_install(bare_machine):
    with pytest.raises(ConfigurationError, match="apt install libosmesa6") as caught:
        graphics.graphics_context(64, 48)
    assert "libegl1" in str(caught.value)


def test_runs_without_a_camera_need_nothing(bare_machine):
    from bluefoot_mpc.model.robot import load_robot
    from bluefoot_mpc.sim.config import SimConfig
    from bluefoot_mpc.sim.robot import SimRobot
    from bluefoot_mpc.sim.sight_config import CameraConfig, LidarConfig

    SimRobot(load_robot(), SimConfig(lidar=LidarConfig(enabled=True), settle_time=0.02))
    with pytest.raises(ConfigurationError, match="apt install"):
        SimRobot(load_robot(), SimConfig(camera=CameraConfig(enabled=True), settle_time=0.02))


def test_pictures_can_be_forbidden(bare_machine, monkeypatch):
    monkeypatch.setenv(graphics.VARIABLE, "off")
    with pytest.raises(ConfigurationError, match="forbids"):
        graphics.chosen_library()


def test_what_says_it_is_a_display_does_not_matter(bare_machine, monkeypatch):
    """Windows are not used: a display that is not there cannot hurt."""
    monkeypatch.setenv("DISPLAY", ":77")
    monkeypatch.setenv(graphics.VARIABLE, "glfw")
    with pytest.raises(ConfigurationError, match="apt install"):
        graphics.chosen_library()
