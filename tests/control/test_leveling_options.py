"""Choices of levelling on the command line: what they stand for, and what is refused with the way out."""

import json

import numpy as np
import pytest

from bluefoot_mpc.cli.main import main
from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError
from bluefoot_mpc.leveling.narx import Narx, NarxConfig, save_weights
from bluefoot_mpc.leveling.signals import INPUT_SCALE, OUTPUT_SCALE
from bluefoot_mpc.scenarios.config import resolve
from bluefoot_mpc.scenarios.options import RunOptions
from bluefoot_mpc.scenarios.walking import Walk


def leveling(**options):
    return resolve(Walk, RunOptions(**options)).stages.control.leveling


@pytest.mark.parametrize("controller", ["cpg", "mpc"])
@pytest.mark.parametrize(
    ("level", "enabled", "psi"), [("none", False, "network"), ("pd", True, "zero"), ("narx", True, "network")]
)
def test_levels_stand_for_parts(controller, level, enabled, psi):
    config = leveling(level=level, controller=controller)
    assert (config.enabled, config.psi, config.attitude) == (enabled, psi, True)
    assert config.form == {"cpg": "mixed", "mpc": "residual"}[controller]


def test_the_share_is_as_asked():
    assert leveling(level="pd", level_mix=0.125).mix == 0.125
    assert leveling(overrides=("control.leveling.enabled=true",), level_mix=0.35).mix == 0.35


@pytest.mark.parametrize("psi", ["zero", "persistence", "model", "network"])
def test_every_part_can_be_chosen_alone(psi):
    config = leveling(
        level="narx", overrides=("control.leveling.attitude=false", f"control.leveling.psi='{psi}'")
    )
    # An option has the last word over --set.
    assert config.psi == "network"
    config = leveling(
        overrides=(
            "control.leveling.enabled=true",
            "control.leveling.attitude=false",
            f"control.leveling.psi='{psi}'",
        )
    )
    assert (config.enabled, config.attitude, config.psi) == (True, False, psi)


@pytest.mark.parametrize("mix", [0.0, 1.0, -1.0, float("nan"), float("inf")])
def test_a_share_outside_of_its_range_is_refused(mix):
    with pytest.raises(ConfigurationError, match="--level-mix.*between 0 and 1"):
        RunOptions(level="pd", level_mix=mix)


def test_an_unknown_level_is_refused():
    with pytest.raises(UnknownNameError, match="levelling 'ndarx'.*Did you mean 'narx'"):
        RunOptions(level="ndarx")


@pytest.mark.parametrize("level", [None, "none"])
def test_a_share_without_levelling_is_refused(level):
    with pytest.raises(ConfigurationError, match="--level-mix has no effect.*--level pd"):
        leveling(level=level, level_mix=0.25)


@pytest.fixture
def refused(capfd, tmp_path):
    """Runs a command line that must be refused, and gives its message."""

    def run(*words):
        out = str(tmp_path / "out")
        assert main(["run", "walk", "--duration", "1", "--no-report", "--out", out, *words, "--json"]) == 2
        return json.loads(capfd.readouterr().out)["error"]

    return run


def set_(words):
    return ("--level", "narx", "--set", f"control.leveling.{words}")


@pytest.mark.parametrize(
    ("words", "evidence", "way_out"),
    [
        (("--level", "pd", "--level-mix", "0"), "0.0", "between 0 and 1"),
        (("--level", "pd", "--level-mix", "1"), "1.0", "between 0 and 1"),
        (("--level", "pd", "--level-mix", "-1"), "-1.0", "between 0 and 1"),
        (("--level", "pd", "--level-mix", "nan"), "nan", "between 0 and 1"),
        (("--level-mix", "0.25"), "no effect", "--level pd or --level narx"),
        (("--level", "none", "--level-mix", "0.25"), "no effect", "--level pd or --level narx"),
        (("--level", "narks"), "narks", "narx, none, pd"),
        (set_("mix=0"), "mix = 0", "--level none"),
        (set_("narx.rate_min=1"), "rate_min = 1", "lower rate_min or raise rate_max"),
        (set_("narx.rate_max=1e-6"), "rate_max = 1e-06", "lower rate_min or raise rate_max"),
        (set_("narx.rate=0.5"), "rate = 0.5", "start inside"),
        (set_("narx.hidden=[0, 50]"), "hidden[0]", "at least 1"),
        (("--set", "control.leveling.psi='magic'"), "magic", "persistence"),
        (set_("form='pure'"), "pure", "residual"),
        (set_("schedule.learn='on'"), "learn", "always"),
        (set_("gains.tilt=-1"), "tilt", "negative"),
        (set_("gains.tilt=nan"), "tilt", "finite"),
        (set_("limits.shift=0"), "shift", "positive"),
        (set_("gain.tilt=1"), "gain", "gains"),
        (set_("delay_ticks=-1"), "delay_ticks", "0..10"),
    ],
)
def test_impossible_choices_are_refused(refused, words, evidence, way_out):
    message = refused(*words)
    assert evidence in message
    assert way_out in message


# Weights.


def file_of(tmp_path, **changes):
    """A file of weights of which some arrays are others."""
    path = tmp_path / "narx.npz"
    save_weights(path, Narx(NarxConfig(), INPUT_SCALE, OUTPUT_SCALE).weights)
    with np.load(path) as stored:
        arrays = dict(stored)
    np.savez(path, **{**arrays, **changes})
    return path


def test_weights_that_fit_are_taken(tmp_path):
    words = ["run", "walk", "--duration", "0.1", "--no-report", "--out", str(tmp_path / "out")]
    assert main([*words, *set_(f"weights='{file_of(tmp_path)}'")]) in (0, 1)


def test_a_missing_file_of_weights_is_refused(refused, tmp_path):
    message = refused(*set_(f"weights='{tmp_path / 'none.npz'}'"))
    assert "none.npz" in message
    assert "name a file that was saved" in message


@pytest.mark.parametrize(
    ("changes", "evidence"),
    [
        ({"version": np.int64(2)}, "version 2 of weights, wanted is 1"),
        ({"delays": np.int64(2)}, "delays"),
        ({"layer_1": np.zeros((20, 79))}, "(20, 79)"),
        ({"layer_2": np.full((50, 51), np.nan)}, "not finite"),
        ({"input_scale": 3.0 * INPUT_SCALE}, "input_scale[0]"),
        ({"output_scale": OUTPUT_SCALE[:6]}, "6 outputs"),
    ],
)
def test_weights_that_do_not_fit_are_refused(refused, tmp_path, changes, evidence):
    path = file_of(tmp_path, **changes)
    message = refused(*set_(f"weights='{path}'"))
    assert evidence in message
    assert "anew" in message


def test_weights_of_another_size_of_network_are_refused(refused, tmp_path):
    path = file_of(tmp_path)
    message = refused(*set_(f"weights='{path}'"), "--set", "control.leveling.narx.hidden=[20, 50]")
    assert "hidden = (50, 50), the network has (20, 50)" in message
    assert "configure it alike or train anew" in message


def test_a_file_that_holds_no_weights_is_refused(refused, tmp_path):
    path = tmp_path / "narx.npz"
    path.write_bytes(b"PK\x03\x04 not quite an archive")
    message = refused(*set_(f"weights='{path}'"))
    assert "narx.npz" in message
    assert "anew" in message


def test_refused_weights_leave_an_earlier_run_alone(refused, tmp_path):
    earlier = tmp_path / "out" / "summary.json"
    earlier.parent.mkdir()
    earlier.write_text("{}")
    refused(*set_("weights='none.npz'"))
    assert [file.name for file in earlier.parent.iterdir()] == ["summary.json"]


def test_a_run_can_go_on_learning_in_its_own_folder(tmp_path):
    path = file_of(tmp_path)
    words = ["run", "walk", "--duration", "0.1", "--no-report", "--out", str(tmp_path)]
    assert main([*words, *set_(f"weights='{path}'")]) in (0, 1)
    assert path.is_file()


def test_a_run_with_loaded_weights_is_thought_through_again_wherever_it_lies(tmp_path, capfd, monkeypatch):
    """Also after the run has written what it learnt over the file that it began with."""
    path = file_of(tmp_path)
    words = ["run", "walk", "--duration", "4", "--no-report", "--out", str(tmp_path)]
    always = ["--set", "control.leveling.schedule.learn='always'"]
    assert main([*words, *set_(f"weights='{path}'"), *always]) in (0, 1)
    moved = tmp_path.rename(tmp_path.with_name("moved"))
    monkeypatch.chdir(moved.parent)
    assert main(["replay", str(moved / "log.mcap"), "--rethink"]) == 0
    (moved / "narx_start.npz").unlink()
    capfd.readouterr()
    assert main(["replay", str(moved / "log.mcap"), "--rethink"]) == 2
    assert "put it back" in " ".join(capfd.readouterr().err.split())
