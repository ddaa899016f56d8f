"""Importing the package is light, and everything from runtime down lives without simulator and viewers."""

import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
HEAVY = ("mujoco", "matplotlib", "plotly", "meshcat", "serial")
WITHOUT_SIMULATOR = (
    "runtime",
    "control",
    "navigation",
    "terrain",
    "wheels",
    "estimation",
    "gait",
    "zmp",
    "model",
    "geometry",
    "settings",
    "types",
)

BLOCK = f"""
    import sys

    class Block:
        def find_spec(self, name, path=None, target=None):
            if name.partition(".")[0] in {HEAVY!r}:
                raise ImportError("blocked: " + name)

    sys.meta_path.insert(0, Block())
"""


def python(code):
    script = textwrap.dedent(BLOCK) + textwrap.dedent(code)
    return subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False, cwd=ROOT
    )


def modules(package):
    folder = ROOT / "bluefoot_mpc" / package
    files = sorted(folder.rglob("*.py")) if folder.is_dir() else [folder.with_suffix(".py")]
    names = [".".join(file.relative_to(ROOT).with_suffix("").parts) for file in files]
    return [name.removesuffix(".__init__") for name in names]


def test_the_block_works():
    done = python("import mujoco")
    assert done.returncode == 1
    assert "blocked: mujoco" in done.stderr


def test_the_package_and_its_model_load_without_simulator_and_viewers():
    done = python("""
        import bluefoot_mpc
        robot = bluefoot_mpc.load_robot()
        assert len(robot.joint_names) == 16
        assert "run" in dir(bluefoot_mpc)
    """)
    assert done.returncode == 0, done.stderr


def test_importing_the_package_alone_loads_nothing_big():
    done = python("""
        import bluefoot_mpc
        big = {"numpy", "scipy", "casadi", "pinocchio", "tyro", "rich"} & set(sys.modules)
        assert not big, big
    """)
    assert done.returncode == 0, done.stderr


def test_every_module_from_runtime_down_loads_without_simulator_and_viewers():
    names = [name for package in WITHOUT_SIMULATOR for name in modules(package)]
    assert "bluefoot_mpc.control.pipeline" in names
    done = python(f"import importlib\nfor name in {names!r}:\n    importlib.import_module(name)")
    assert done.returncode == 0, done.stderr


def test_the_help_loads_neither_simulator_nor_dynamics():
    done = python("""
        from bluefoot_mpc.cli.main import main
        assert main(["run", "--help"]) == 0
        assert "pinocchio" not in sys.modules
    """)
    assert done.returncode == 0, done.stderr


def test_an_unknown_export_is_an_attribute_error():
    import bluefoot_mpc

    with pytest.raises(AttributeError, match="frobnicate"):
        _ = bluefoot_mpc.frobnicate
