"""``bluefoot doctor``: what the software on this machine needs."""

from __future__ import annotations

import re
import subprocess
import sys
from importlib import metadata

from bluefoot_mpc.codegen.compiler import CodegenUnavailable, find_compiler
from bluefoot_mpc.codegen.config import CodegenConfig
from bluefoot_mpc.io.findings import Finding, Severity
from bluefoot_mpc.io.serial_link import available_ports
from bluefoot_mpc.sim.graphics import MEND
from bluefoot_mpc.tuning.identify import SYSID_NEEDS

_OLDEST_PYTHON = (3, 11)
_RENDER = (
    "from bluefoot_mpc.sim.graphics import chosen_library, graphics_context; import mujoco;"
    "m = mujoco.MjModel.from_xml_string('<mujoco/>');"
    "g = graphics_context(8, 8); g.make_current();"
    "r = mujoco.MjrContext(m, mujoco.mjtFontScale.mjFONTSCALE_100);"
    "r.free(); g.free(); print(chosen_library())"
)
_RENDER_PATIENCE = 60.0
_NAME = re.compile(r"^[A-Za-z0-9._-]+")


def check_software() -> list[Finding]:
    """Interpreter, packages, compiler for generated code, rendering, serial ports."""
    return [_python(), *_packages(), _identification(), _compiler(), _rendering(), _ports()]


def _python() -> Finding:
    text = f"{sys.version_info.major}.{sys.version_info.minor}.{sys.version_info.micro}"
    if sys.version_info[:2] < _OLDEST_PYTHON:
        wanted = ".".join(map(str, _OLDEST_PYTHON))
        return _refusal("python", text, f"Install Python {wanted} or newer, then: make setup")
    return Finding(part="python", text=text)


def _packages() -> list[Finding]:
    """What the package asks for and is not there."""
    try:
        asked = metadata.requires("bluefoot-mpc") or []
    except metadata.PackageNotFoundError:
        return [_refusal("packages", "bluefoot-mpc is not installed", "Install it: make setup")]
    names = [match.group() for line in asked if "extra ==" not in line and (match := _NAME.match(line))]
    missing = [name for name in names if not _is_installed(name)]
    if missing:
        return [_refusal("packages", f"missing: {', '.join(missing)}", "Install them: make setup")]
    return [Finding(part="packages", text=f"all {len(names)} are installed")]


def _identification() -> Finding:
    """`mujoco.sysid` has needs of its own."""
    missing = [name for name in SYSID_NEEDS if not _is_installed(name)]
    if missing:
        text = f"mujoco.sysid lacks {', '.join(missing)}: servos are fitted with SciPy alone"
        mend = f"To use it: pip install {' '.join(missing)}"
        return Finding(part="identification", text=text, mend=mend, severity=Severity.NOTE)
    return Finding(part="identification", text="mujoco.sysid can be used")


def _compiler() -> Finding:
    try:
        compiler = find_compiler(CodegenConfig())
    except CodegenUnavailable as error:
        mend = "Install gcc (Debian: apt install gcc); without it controllers run on slower code"
        return Finding(part="compiler", text=str(error), mend=mend, severity=Severity.WARNING)
    return Finding(part="compiler", text=" ".join(compiler.command))


def _rendering() -> Finding:
    """One small picture, in a process of its own: a missing driver may end it."""
    part = "rendering"
    mend = f"Needed for pictures and the simulated camera alone. To have them, {MEND}"
    try:
        done = subprocess.run(
            [sys.executable, "-c", _RENDER], capture_output=True, text=True, check=False,
            timeout=_RENDER_PATIENCE,
        )  # fmt: skip
    except (OSError, subprocess.TimeoutExpired) as error:
        return Finding(part=part, text=f"not tried: {error}", mend=mend, severity=Severity.NOTE)
    if done.returncode != 0:
        last = (done.stderr.strip().splitlines() or [f"exit status {done.returncode}"])[-1]
        return Finding(
            part=part, text=f"MuJoCo draws nothing: {last[:120]}", mend=mend, severity=Severity.NOTE
        )
    return Finding(part=part, text=f"MuJoCo draws ({done.stdout.strip()})")


def _ports() -> Finding:
    ports = available_ports()
    if not ports:
        mend = "Plug the adapter in; an emulator is a port like any other: bluefoot emulator"
        return Finding(part="serial ports", text="there is none", mend=mend, severity=Severity.NOTE)
    return Finding(part="serial ports", text=", ".join(ports))


def _is_installed(name: str) -> bool:
    try:
        metadata.version(name)
    except metadata.PackageNotFoundError:
        return False
    return True


def _refusal(part: str, text: str, mend: str) -> Finding:
    return Finding(part=part, text=text, mend=mend, severity=Severity.REFUSAL)
