import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

SCRIPT = Path(__file__).parents[2] / "scripts" / "wheels.py"


def run(*arguments):
    command = [sys.executable, str(SCRIPT), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_the_page_is_one_file_with_all_pictures(tmp_path):
    path = tmp_path / "new" / "wheels.html"
    done = run(path)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    page = path.read_text(encoding="utf-8")
    assert page.count("plotly-graph-div") >= 8
    for title in ("Ready robots", "An Ackermann turn", "Mecanum wheels", "A robot that balances", "Legs"):
        assert f"<h2>{title}</h2>" in page
    assert "<script src" not in page
    assert "<link" not in page


def test_a_place_that_cannot_be_written_is_named(tmp_path):
    done = run(tmp_path)
    assert done.returncode == 2
    assert f"cannot write {tmp_path}" in done.stderr
    assert "Traceback" not in done.stderr
