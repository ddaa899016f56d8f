"""Drawing without a screen: which of the machine's libraries does it, found out when it is needed.

MuJoCo chooses its library when it is imported, from MUJOCO_GL alone, and then
wants a display where nothing is chosen. PyOpenGL, which it goes through, takes
the first library that is tried and no other later. So what works is found out
here first, without PyOpenGL.
"""

from __future__ import annotations

import ctypes
import importlib
import os
import sys
from collections.abc import Callable
from typing import Any

from bluefoot_mpc.exceptions import ConfigurationError

VARIABLE = "MUJOCO_GL"
"""Environment variable that chooses the library, MuJoCo's own."""
MEND = (
    "install OSMesa (Debian and Ubuntu: apt install libosmesa6),"
    " or EGL where there is none (apt install libegl1 libopengl0 libgl1-mesa-dri)"
)
"""Way out where nothing can draw."""

_PLATFORM = "PYOPENGL_PLATFORM"
_EGL_NAMES, _OSMESA_NAMES = ("libEGL.so.1", "libEGL.so"), ("libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so")
_OPENGL_NAMES = ("libOpenGL.so.0", "libGL.so.1", "libOpenGL.so", "libGL.so")
_PLATFORM_DEVICE = 0x313F  # EGL_EXT_platform_device
_MOST_DEVICES = 16


def graphics_context(width: int, height: int) -> Any:
    """MuJoCo's context for drawing off the screen; to be made current where it is used, in any thread.

    Args:
        width: pixels of the largest picture.
        height: pixels of the largest picture.

    Raises:
        ConfigurationError: nothing here can draw, or what MUJOCO_GL chooses cannot.
    """
    name = chosen_library()
    if "OpenGL" not in sys.modules:
        # A parent process may have left its own choice here, which PyOpenGL would follow.
        os.environ[_PLATFORM] = name
    try:
        context = importlib.import_module(f"mujoco.{name}").GLContext(width, height)
        with context.as_current():
            pass
    except (ImportError, AttributeError, OSError, RuntimeError) as error:
        raise ConfigurationError(
            f"no pictures can be drawn with '{name}' ({error}). To have a camera, {MEND};"
            f" unset {VARIABLE} to take what works"
        ) from error
    return context


def chosen_library() -> str:
    """``egl`` or ``osmesa``: the one that MUJOCO_GL names, else the first that works.

    What MUJOCO_GL says of windows does not matter: these pictures need none.

    Raises:
        ConfigurationError: MUJOCO_GL forbids pictures, or nothing works.
    """
    chosen = os.environ.get(VARIABLE, "").strip().lower()
    if chosen in ("egl", "osmesa"):
        return chosen
    if chosen in ("disable", "disabled", "off", "false", "0"):
        raise ConfigurationError(f"{VARIABLE}={chosen} forbids pictures: unset it, or run without a camera")
    if _egl_works():
        return "egl"
    if _loads(_OSMESA_NAMES) is not None:
        return "osmesa"
    raise ConfigurationError(
        f"nothing on this machine can draw pictures for the simulated camera: {MEND}; or run without a camera"
    )


def _loads(names: tuple[str, ...]) -> ctypes.CDLL | None:
    for name in names:
        try:
            return ctypes.CDLL(name)
        except OSError:
            continue
    return None


def _egl_works() -> bool:
    """Whether EGL has a device that it can draw on without a display, and PyOpenGL what it goes through."""
    egl = _loads(_EGL_NAMES)
    if egl is None or _loads(_OPENGL_NAMES) is None:
        return False
    query = _extension(egl, b"eglQueryDevicesEXT", ctypes.c_uint)
    display_of = _extension(egl, b"eglGetPlatformDisplayEXT", ctypes.c_void_p)
    if query is None or display_of is None:
        return False
    devices, count = (ctypes.c_void_p * _MOST_DEVICES)(), ctypes.c_int(0)
    if not query(ctypes.c_int(_MOST_DEVICES), devices, ctypes.byref(count)):
        return False
    egl.eglInitialize.restype = ctypes.c_uint
    for device in devices[: count.value]:
        display = display_of(ctypes.c_uint(_PLATFORM_DEVICE), ctypes.c_void_p(device), None)
        # Stays initialised: MuJoCo uses the same one.
        if display and egl.eglInitialize(ctypes.c_void_p(display), None, None):
            return True
    return False


def _extension(egl: ctypes.CDLL, name: bytes, result: Any) -> Callable[..., Any] | None:
    egl.eglGetProcAddress.restype = ctypes.c_void_p
    address = egl.eglGetProcAddress(name)
    return ctypes.CFUNCTYPE(result)(address) if address else None
