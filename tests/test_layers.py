"""Imports point downward: the contracts of pyproject.toml hold, and a breach is seen."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
LINT = "from importlinter.cli import lint_imports_command; lint_imports_command()"


def lint(folder):
    return subprocess.run(
        [sys.executable, "-c", LINT, "--no-cache", "--no-logo"],
        cwd=folder,
        env={"PYTHONPATH": str(folder), "PATH": ""},
        capture_output=True,
        text=True,
        check=False,
    )


def test_contracts_hold():
    done = lint(ROOT)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize(
    ("where", "line", "contract"),
    [
        ("zmp/placement.py", "import bluefoot_mpc.gait", "imports point downward"),
        ("geometry.py", "import bluefoot_mpc.model.robot", "imports point downward"),
        ("newcomer/__init__.py", "", "imports point downward"),
        ("control/pipeline.py", "import bluefoot_mpc.io.robot", "control never imports io"),
        ("sim/robot.py", "import bluefoot_mpc.estimation", "sim knows no controller"),
        ("model/robot.py", "import mujoco", "need no simulator"),
        ("runtime/loop.py", "import matplotlib.pyplot", "need no simulator"),
    ],
)
def test_a_breach_is_seen(tmp_path, where, line, contract):
    shutil.copytree(
        ROOT / "bluefoot_mpc", tmp_path / "bluefoot_mpc", ignore=shutil.ignore_patterns("__pycache__")
    )
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    file = tmp_path / "bluefoot_mpc" / where
    file.parent.mkdir(exist_ok=True)
    with file.open("a") as stream:
        stream.write(f"\n{line}\n")
    done = lint(tmp_path)
    assert done.returncode == 1, done.stdout + done.stderr
    broken = [row for row in done.stdout.splitlines() if row.endswith("BROKEN")]
    assert any(contract in row for row in broken), done.stdout
