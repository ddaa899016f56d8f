"""The wheel works outside the checkout: models, scenes and templates travel in it."""

import json
import os
import shlex
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    done = subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    (file,) = folder.glob("*.whl")
    return file


@pytest.fixture(scope="module")
def installed(wheel, tmp_path_factory):
    """Python that finds the wheel's package and not the checkout, in another folder."""
    folder = tmp_path_factory.mktemp("site")
    command = [
        "-m",
        "pip",
        "install",
        "--quiet",
        "--no-deps",
        "--no-index",
        "--target",
        str(folder),
        str(wheel),
    ]
    subprocess.run([sys.executable, *command], check=True, capture_output=True)
    elsewhere = tmp_path_factory.mktemp("elsewhere")

    def python(*words):
        return subprocess.run(
            [sys.executable, *words],
            cwd=elsewhere,
            env={**os.environ, "PYTHONPATH": str(folder)},
            capture_output=True,
            text=True,
            check=False,
        )

    where = python("-c", "import bluefoot_mpc; print(bluefoot_mpc.__file__)").stdout
    assert where.startswith(str(folder))
    return python


def test_it_holds_everything_that_is_not_python(wheel):
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
    package = ROOT / "bluefoot_mpc"
    files = {path for path in package.rglob("*") if path.is_file() and path.suffix not in (".py", ".pyc")}
    expected = {f"bluefoot_mpc/{path.relative_to(package)}" for path in files}
    models = {path.relative_to(ROOT / "models") for path in (ROOT / "models").rglob("*") if path.is_file()}
    expected |= {f"bluefoot_mpc/_data/models/{path}" for path in models}
    assert "bluefoot_mpc/py.typed" in names
    assert expected <= names, expected - names
    assert not any(name.startswith(("tests/", "scripts/")) for name in names)


def test_it_names_its_console_script_and_licence(wheel):
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        (entry,) = (name for name in names if name.endswith("entry_points.txt"))
        assert "bluefoot = bluefoot_mpc.cli.main:main" in archive.read(entry).decode()
    assert any(name.endswith("licenses/LICENSE") for name in names)


def test_the_robot_loads_from_another_folder(installed):
    code = "import bluefoot_mpc; print(len(bluefoot_mpc.load_robot().joint_names))"
    done = installed("-c", code)
    assert (done.returncode, done.stdout) == (0, "16\n"), done.stderr


def test_the_commands_run_from_another_folder(installed):
    listed = installed("-m", "bluefoot_mpc.cli", "list", "--json")
    assert listed.returncode == 0, listed.stderr
    assert "walk" in json.loads(listed.stdout)["scenarios"]
    checked = installed("-m", "bluefoot_mpc.cli", "model", "urdf", "--check", "--json")
    assert json.loads(checked.stdout)["up_to_date"], checked.stderr


@pytest.mark.slow
def test_a_run_from_another_folder_walks(installed, tmp_path):
    done = installed(
        *shlex.split("-m bluefoot_mpc.cli run walk --duration 4 --json --out"), str(tmp_path / "run")
    )
    assert done.returncode in (0, 1), done.stderr
    assert not json.loads(done.stdout)["fell"]
    assert (tmp_path / "run" / "report.html").is_file()
