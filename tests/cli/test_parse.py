"""Command lines: what they turn into, and one clear complaint where they cannot."""

import shlex
from pathlib import Path

import pytest

from bluefoot_mpc.cli import arguments
from bluefoot_mpc.cli.parse import COMMANDS, UsageError, option_names, parse
from bluefoot_mpc.exceptions import BlueFootError, ConfigurationError, UnknownNameError
from bluefoot_mpc.scenarios import options as run_options
from bluefoot_mpc.scenarios.options import RunOptions
from bluefoot_mpc.sim.config import WORLDS

EVERYTHING = shlex.split("""
    run push --robot sim --controller cpg --model m.toml --seed 7 --duration 12.5 --out there --view
    --config c.toml --set sim.world.friction=0.4 --set control.gait=walk --randomize standard --no-report
    --world steps --friction 0.7 --slope -5 --payload 0.3,0.01,-0.02,0.05 --gait walk --speed 0.06
    --lateral-speed -0.01 --yaw-rate 0.2 --impulse 2 --direction -45 --push-time 4 --json
""")


def test_every_option_of_run_arrives_under_its_name():
    command = parse(EVERYTHING)
    assert command.scenario == "push"
    assert command.json
    assert RunOptions(**command.run_fields()) == RunOptions(
        robot="sim",
        controller="cpg",
        model="m.toml",
        seed=7,
        duration=12.5,
        out=Path("there"),
        view=True,
        config=Path("c.toml"),
        overrides=("sim.world.friction=0.4", "control.gait=walk"),
        randomize="standard",
        report=False,
        world="steps",
        friction=0.7,
        slope=-5.0,
        payload=(0.3, 0.01, -0.02, 0.05),
        gait="walk",
        speed=0.06,
        lateral_speed=-0.01,
        yaw_rate=0.2,
        impulse=2.0,
        direction=-45.0,
        push_time=4.0,
    )


def test_without_options_a_run_has_the_defaults():
    assert RunOptions(**parse(["run", "walk"]).run_fields()) == RunOptions()


def test_options_before_the_scenario_and_with_an_equals_sign():
    command = parse(["run", "--speed=0.04", "walk"])
    assert (command.scenario, command.speed) == ("walk", 0.04)


@pytest.mark.parametrize(
    ("words", "kind"),
    [
        (["list"], arguments.ListCommand),
        (["replay", "log.mcap"], arguments.ReplayCommand),
        (["model", "check"], arguments.CheckCommand),
        (["model", "urdf"], arguments.UrdfCommand),
        (["model", "rom"], arguments.RomCommand),
        (["model", "power"], arguments.PowerCommand),
        (["drive"], arguments.DriveCommand),
    ],
)
def test_every_command_takes_json(words, kind):
    assert type(parse(words)) is kind
    assert not parse(words).json
    assert parse([*words, "--json"]).json


@pytest.mark.parametrize(
    ("words", "named"),
    [
        ([], ["list", "run", "replay", "model", "drive"]),
        (["wlk"], ["wlk", "list", "run", "replay", "model", "drive"]),
        (["model"], ["check", "urdf", "rom", "power"]),
        (["model", "chek"], ["chek", "Did you mean 'check'?", "power"]),
        (["run"], ["SCENARIO"]),
        (["run", "walk", "run"], ["run"]),
        (
            ["run", "walk", "--sped", "1"],
            ["--sped", "Did you mean '--speed'?", "--lateral-speed", "--no-report"],
        ),
        (["run", "walk", "--sped=1"], ["'--sped'", "--speed"]),
        (["run", "walk", "--speed", "fast"], ["--speed", "fast", "number"]),
        (["run", "walk", "--seed", "1.5"], ["--seed", "1.5", "whole number"]),
        (["run", "walk", "--speed"], ["--speed"]),
        (["model", "check", "--states", "0"], ["--states", "0"]),
        (["model", "check", "--states", "99999999999"], ["--states", "1000000"]),
        (["drive", "--timeout", "0"], ["--timeout", "0"]),
        (["list", "--seed", "1"], ["--seed", "--json"]),
        (["--debug", "list"], ["--debug stands before the command", "list", "drive"]),
    ],
)
def test_wrong_use_is_one_message_that_names_what_is_valid(words, named):
    with pytest.raises(ConfigurationError) as caught:
        parse(words)
    message = str(caught.value)
    assert caught.value.exit_status == 2
    assert all(name in message for name in named), message
    assert "\n" not in message
    assert "│" not in message


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["--robot", "spot"], ["spot", "emulator, hardware, sim"]),
        (["--controller", "lqr"], ["lqr", "mpc", "cpg"]),
        (["--randomize", "lots"], ["lots", "none", "standard"]),
        (["--gait", "canter"], ["canter", "trot", "walk"]),
        (["--duration", "-3"], ["--duration", "-3"]),
        (["--speed", "nan"], ["--speed", "nan"]),
        (["--payload", "1,2,3"], ["--payload", "1,2,3", "KG,X,Y,Z"]),
        (["--payload", "a,b,c,d"], ["--payload", "KG,X,Y,Z"]),
    ],
)
def test_wrong_values_of_run_are_named(words, named):
    with pytest.raises(ConfigurationError) as caught:
        RunOptions(**parse(["run", "walk", *words]).run_fields())
    assert all(name in str(caught.value) for name in named), caught.value


def test_the_choices_in_the_help_are_the_valid_ones(capsys):
    with pytest.raises(SystemExit) as stop:
        parse(["run", "--help"])
    assert not stop.value.code
    text = capsys.readouterr().out
    for names in (
        run_options.ROBOTS,
        run_options.CONTROLLERS,
        run_options.RANDOMIZATIONS,
        run_options.GAITS,
    ):
        assert "{" + ",".join(names) + "}" in text
    assert ", ".join(WORLDS) in " ".join(text.replace("│", "").split())


@pytest.mark.parametrize(
    "words", [[name] for name in COMMANDS] + [["model", n] for n in COMMANDS["model"]] + [[]]
)
def test_every_command_has_help(words, capsys):
    with pytest.raises(SystemExit) as stop:
        parse([*words, "--help"])
    assert not stop.value.code
    assert "usage: bluefoot" in capsys.readouterr().out


def test_the_help_tells_the_exit_statuses_and_the_version_is_there(capsys):
    for words, told in (["--help"], "130 interrupted"), (["--version"], "bluefoot 0."):
        with pytest.raises(SystemExit) as stop:
            parse(words)
        assert not stop.value.code
        assert told in capsys.readouterr().out


def test_help_of_run_names_every_option(capsys):
    command = parse(["run", "walk"])
    with pytest.raises(SystemExit):
        parse(["run", "--help"])
    text = capsys.readouterr().out
    assert all(name in text for name in option_names(command))


def test_usage_errors_share_the_root():
    assert issubclass(UsageError, BlueFootError)
    assert issubclass(UnknownNameError, BlueFootError)
