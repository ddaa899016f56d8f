"""The entry point: exit status, one JSON object, one message, never a traceback."""

import json
import logging
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from bluefoot_mpc.cli import main as entry
from bluefoot_mpc.cli import messages
from bluefoot_mpc.cli.main import main
from bluefoot_mpc.cli.outcome import Outcome, to_json
from bluefoot_mpc.cli.script import main_for
from bluefoot_mpc.exceptions import ConfigurationError, DeviceError

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def replaced(monkeypatch):
    """Let `bluefoot list` do something else."""

    def replace(function):
        monkeypatch.setattr(entry, "_execute", lambda words, prog: function())

    return replace


def raising(error):
    def function():
        raise error

    return function


def test_a_page_goes_to_standard_output(replaced, capsys):
    replaced(lambda: Outcome(status=1, page=("one", "two"), data={"n": 1}))
    assert main(["list"]) == 1
    assert capsys.readouterr().out == "one\ntwo\n"


def test_json_is_one_object_and_nothing_else(replaced, capfd):
    def chatty():
        print("a library talks")
        os.write(1, b"a library in C talks\n")
        return Outcome(page=("page",), data={"speed": 0.1, "folder": Path("runs/x")})

    replaced(chatty)
    assert main(["list", "--json"]) == 0
    out, err = capfd.readouterr()
    assert json.loads(out) == {"speed": 0.1, "folder": "runs/x"}
    assert "a library talks" in err
    assert "a library in C talks" in err


def test_json_knows_arrays_and_has_null_for_what_it_lacks():
    data = {
        "nan": float("nan"),
        "inf": np.float64("inf"),
        "row": np.arange(4.0)[::2],
        "grid": np.zeros((1, 2)),
        "flag": np.True_,
        "set": {"b", "a"},
    }
    assert json.loads(to_json(data)) == {
        "nan": None,
        "inf": None,
        "row": [0.0, 2.0],
        "grid": [[0.0, 0.0]],
        "flag": True,
        "set": ["a", "b"],
    }


@pytest.mark.parametrize(
    ("error", "status"),
    [(ConfigurationError("no such thing"), 2), (DeviceError("not armed"), 3), (KeyboardInterrupt(), 130)],
)
def test_errors_have_their_exit_status_and_one_message(replaced, capsys, error, status):
    error.add_note("the log is in runs/7")
    replaced(raising(error))
    assert main(["list"]) == status
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("bluefoot: ")
    assert str(error) in err
    assert "the log is in runs/7" in err
    assert "Traceback" not in err


def test_an_error_is_an_object_too(replaced, capsys):
    replaced(raising(ConfigurationError("no [such] thing")))
    assert main(["list", "--json"]) == 2
    out, err = capsys.readouterr()
    assert json.loads(out) == {"error": "no [such] thing", "exit_status": 2}
    assert "no [such] thing" in err


def test_an_unexpected_error_leaves_its_traceback_in_a_file(replaced, capsys, tmp_path, monkeypatch):
    monkeypatch.setattr(messages.tempfile, "gettempdir", lambda: str(tmp_path))
    replaced(raising(ZeroDivisionError("by zero")))
    assert main(["list"]) == 1
    (kept,) = tmp_path.iterdir()
    err = capsys.readouterr().err
    assert "ZeroDivisionError: by zero" in err
    assert str(kept) in err
    assert "Traceback" not in err
    assert "Traceback" in kept.read_text()


def logging_things():
    log = logging.getLogger("bluefoot_mpc.runtime.loop")
    log.info("nobody asked")
    log.warning("mind the gap of %d mm", 3)
    logging.getLogger("bluefoot_mpc.viz.live").info("live view at %s", "somewhere")
    try:
        _ = 1 / 0
    except ZeroDivisionError:
        log.exception("the controller failed")
    return Outcome()


def test_warnings_and_addresses_are_lines_and_tracebacks_go_to_a_file(
    replaced, capsys, tmp_path, monkeypatch
):
    monkeypatch.setattr(messages.tempfile, "gettempdir", lambda: str(tmp_path))
    replaced(logging_things)
    main(["list"])
    err = capsys.readouterr().err
    assert "mind the gap of 3 mm" in err
    assert "live view at somewhere" in err
    assert "the controller failed: ZeroDivisionError" in err
    assert "nobody asked" not in err
    assert "Traceback" not in err
    (kept,) = tmp_path.iterdir()
    assert "Traceback" in kept.read_text()
    assert not logging.getLogger("bluefoot_mpc").handlers


def test_debug_shows_everything_logged(replaced, capsys):
    replaced(logging_things)
    main(["list", "--debug"])
    err = capsys.readouterr().err
    assert "nobody asked" in err
    assert "Traceback" in err


def test_debug_shows_the_traceback(replaced):
    replaced(raising(ZeroDivisionError("by zero")))
    with pytest.raises(ZeroDivisionError):
        main(["list", "--debug"])


def test_scripts_run_their_scenario_with_the_options_given(monkeypatch):
    seen = []
    monkeypatch.setattr("bluefoot_mpc.cli.script.main", lambda words: seen.append(words) or 1)
    monkeypatch.setattr(sys, "argv", ["scripts/walk.py", "--speed", "0.06"])
    with pytest.raises(SystemExit) as stop:
        main_for("walk")
    assert stop.value.code == 1
    assert seen == [["run", "walk", "--speed", "0.06"]]


def bluefoot(*words, **kwargs):
    return subprocess.run(
        [sys.executable, "-m", "bluefoot_mpc.cli", *words],
        capture_output=True,
        text=True,
        check=False,
        **kwargs,
    )


def test_as_a_process_wrong_use_ends_with_2():
    done = bluefoot("run", "walk", "--sped", "1")
    assert done.returncode == 2
    assert done.stdout == ""
    assert "Did you mean '--speed'?" in done.stderr


def test_a_reader_that_goes_away_is_no_error():
    reader, writer = os.pipe()
    os.close(reader)
    done = subprocess.run(
        [sys.executable, "-m", "bluefoot_mpc.cli", "model", "power"],
        stdout=writer,
        stderr=subprocess.PIPE,
        check=False,
    )
    os.close(writer)
    assert done.stderr == b""
    assert done.returncode == 0


@pytest.mark.parametrize("words", [["--help"], ["run", "--help"], ["list"]])
def test_a_reader_of_the_help_may_go_away_too(words):
    reader, writer = os.pipe()
    os.close(reader)
    command = [sys.executable, "-m", "bluefoot_mpc.cli", *words]
    done = subprocess.run(command, stdout=writer, stderr=subprocess.PIPE, check=False)
    os.close(writer)
    assert (done.returncode, done.stderr) == (0, b"")


@pytest.mark.parametrize("words", [["model", "power"], ["model", "power", "--json"], ["list"]])
def test_standard_output_may_be_closed(words):
    line = 'exec "$0" -m bluefoot_mpc.cli "$@" >&-'
    done = subprocess.run(["bash", "-c", line, sys.executable, *words], stderr=subprocess.PIPE, check=False)
    assert (done.returncode, done.stderr) == (0, b"")


@pytest.mark.parametrize("words", [["list"], ["list", "--json"]])
def test_a_full_disk_behind_standard_output_is_one_message(words):
    with open("/dev/full", "w") as full:
        command = [sys.executable, "-m", "bluefoot_mpc.cli", *words]
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 1
    assert done.stderr == "bluefoot: cannot write to standard output: No space left on device\n"


def test_signs_that_the_terminal_lacks_are_replaced():
    plain = {**os.environ, "PYTHONIOENCODING": "ascii"}
    script = (
        "import sys; from bluefoot_mpc.cli import main as m; from bluefoot_mpc.cli.outcome import Outcome;"
    )
    script += "m._execute = lambda words, prog: Outcome(page=('0.2 N·m',)); sys.exit(m.main(['list']))"
    done = subprocess.run([sys.executable, "-c", script], env=plain, capture_output=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, b"0.2 N?m\n", b"")


def test_drive_without_a_terminal_is_wrong_use():
    done = bluefoot("drive", "--no-view", stdin=subprocess.DEVNULL)
    assert done.returncode == 2
    assert "no terminal" in done.stderr
