import tomllib

import pytest

from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError
from bluefoot_mpc.scenarios.config import resolve
from bluefoot_mpc.scenarios.options import RunOptions
from bluefoot_mpc.scenarios.posing import Stand
from bluefoot_mpc.scenarios.registry import SHIPPED, find_scenario
from bluefoot_mpc.scenarios.walking import Push, Walk
from bluefoot_mpc.settings import dump_toml


def test_every_scenario_resolves_and_survives_a_round_trip_through_its_file(tmp_path):
    for scenario in SHIPPED.values():
        first = resolve(scenario, RunOptions(seed=3)).table()
        text = dump_toml(first)
        assert tomllib.loads(text)["run"] == {
            "scenario": scenario.name,
            "seed": 3,
            "robot": "sim",
            "controller": scenario.default_controller,
        }
        file = tmp_path / f"{scenario.name}.toml"
        file.write_text(text)
        again = resolve(scenario, RunOptions(seed=3, config=file)).table()
        # A push is scheduled by the scenario each time it is resolved.
        for table in (first, again):
            table["sim"].pop("pushes", None)
        assert again == first


def test_options_beat_overrides_beat_the_file_beat_defaults(tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text("[scenario]\nspeed = 0.03\nduration = 11.0\nyaw_rate = 0.2\n")
    options = RunOptions(
        config=file, overrides=("scenario.duration=12.0", "scenario.yaw_rate=0.3"), yaw_rate=0.1
    )
    config = resolve(Walk, options).scenario.config
    assert (config.speed, config.duration, config.yaw_rate) == (0.03, 12.0, 0.1)


def test_world_options_reach_the_simulator():
    options = RunOptions(
        world="rough", friction=0.5, slope=4.0, payload=(0.2, 0.01, 0.0, 0.05), randomize="standard"
    )
    sim = resolve(Walk, options).stages.sim
    assert (sim.world.name, sim.world.friction, sim.world.slope_deg) == ("rough", 0.5, 4.0)
    assert sim.world.payload == (0.2, 0.01, 0.0, 0.05)
    assert sim.randomization.preset == "standard"


def test_a_push_reaches_the_simulator():
    (push,) = resolve(Push, RunOptions(impulse=3.0, direction=45.0, push_time=4.0)).stages.sim.pushes
    assert (push.impulse, push.direction_deg, push.time, push.duration) == (3.0, 45.0, 4.0, 0.1)


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("gait.speed=1", "unknown configuration section 'gait'.*control"),
        ("control.gait.trott.cycle_min=1", "unknown key in .*trott.*Did you mean 'trot'"),
        ("control.gait.trot.cycle_min=fast", "cycle_min = 'fast' must be of type float"),
        ("control.gait.trot.cycle_min=-1.0", "cycle_min = -1.0 must be positive"),
        ("control.zmp.gain=nan", "must be finite"),
        ("sim.latency=-0.1", "latency = -0.1 must lie in 0..1"),
        ("scenario.speed=9.0", "beyond what the robot can do"),
        ("scenario.gait=gallop", "gallop.*trot, walk"),
        ("model.legs.hip_offset=-0.1", "hip_offset = -0.1 must be positive"),
        ("nonsense", "not of the form section.key=value"),
        ("scenario=1", "scenario must be a table, not 1"),
        ("model=1", "model must be a table, not 1"),
        ("sim=1", "sim must be a table, not 1"),
        ("scenario.duration=1e300", "duration = 1e\\+300 s must be at most 7200 s"),
    ],
)
def test_a_bad_override_names_value_and_choices(override, message):
    with pytest.raises(ConfigurationError, match=message):
        resolve(Walk, RunOptions(overrides=(override,)))


@pytest.mark.parametrize(
    ("bad", "message"),
    [
        ({"duration": -1.0}, "--duration = -1.0 must be a positive number"),
        ({"duration": float("nan")}, "--duration"),
        ({"speed": float("inf")}, "--speed"),
        ({"gait": "gallop"}, "unknown gait 'gallop'.*trot, walk"),
        ({"robot": "spot"}, "unknown robot 'spot'.*emulator, hardware, sim"),
        ({"link": "pty"}, "--link is for --robot emulator"),
        ({"robot": "emulator", "link": "usb"}, "unknown link 'usb'.*memory, pty"),
        ({"robot": "emulator", "port": ("/dev/ttyUSB0",)}, "--port and --baud are for --robot hardware"),
        ({"robot": "hardware", "baud": 12}, "--baud = 12 must lie in"),
        ({"controller": "lqr"}, "unknown controller 'lqr'.*cpg"),
        ({"randomize": "wild"}, "unknown randomization"),
        ({"friction": 0.0}, "--friction"),
        ({"seed": -1}, "--seed"),
        ({"seed": 10**30}, "--seed = 1000.* must lie in 0.."),
        ({"push_time": -2.0}, "--push-time"),
        ({"payload": (0.1, 0.0, float("nan"), 0.0)}, "--payload"),
    ],
)
def test_a_bad_option_is_refused_by_name(bad, message):
    with pytest.raises(ConfigurationError, match=message):
        RunOptions(**bad)


def test_an_option_that_the_scenario_does_not_have_is_refused():
    with pytest.raises(ConfigurationError, match="'stand' has no option --speed; it takes: --duration"):
        resolve(Stand, RunOptions(speed=0.1))


def test_a_push_after_the_end_is_refused():
    with pytest.raises(ConfigurationError, match="beyond the end of the run"):
        resolve(Push, RunOptions(push_time=50.0))


def test_a_push_beyond_all_sense_is_refused():
    with pytest.raises(ConfigurationError, match="impulse = 1e\\+09 N·s must be at most 100"):
        resolve(Push, RunOptions(impulse=1e9))


def test_two_controllers_on_one_command_line_are_told_apart():
    overrides = ("run.controller=cpg", "control.zmp.gain=1.0")
    message = "^--set run.controller=cpg and --controller mpc differ: leave one out"
    with pytest.raises(ConfigurationError, match=message):
        resolve(Walk, RunOptions(controller="mpc", overrides=overrides))


@pytest.mark.parametrize("value", [None, [("zmp", 1)], "zmp"])
def test_a_scenario_that_changes_no_table_is_refused(value):
    class Mine(Walk):
        name = "mine"

        def control(self, controller):
            return value

    with pytest.raises(ConfigurationError, match="'mine': control\\(\\) must return a table"):
        resolve(Mine, RunOptions())


@pytest.mark.parametrize("value", [None, "pid", 3, ["cpg"]])
def test_a_scenario_with_a_controller_that_does_not_exist_is_refused(value):
    class Mine(Walk):
        name = "mine"
        default_controller = value

    with pytest.raises(ConfigurationError, match="'mine': default_controller = .* must be one of: cpg, mpc"):
        resolve(Mine, RunOptions(controller="cpg"))


def test_a_missing_configuration_file_is_named(tmp_path):
    with pytest.raises(ConfigurationError, match="cannot read .*absent.toml"):
        resolve(Walk, RunOptions(config=tmp_path / "absent.toml"))


def test_an_unknown_scenario_lists_the_known_ones():
    with pytest.raises(UnknownNameError, match="unknown scenario 'wlak'. Did you mean 'walk'\\?.*transition"):
        find_scenario("wlak")


SCRIPT = """
from bluefoot_mpc import Scenario
from bluefoot_mpc.types import MotionCommand

class Mine(Scenario):
    '''My own.'''
    name = "mine"
    def command(self, time):
        return MotionCommand()
"""


def test_a_users_script_is_found_by_its_path(tmp_path):
    file = tmp_path / "mine.py"
    file.write_text(SCRIPT)
    scenario = find_scenario(str(file))
    assert scenario.name == "mine"
    assert scenario.describe() == "My own."


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("x = 1\n", "exactly one subclass of Scenario; found: none"),
        (SCRIPT + "class Other(Mine):\n    name = 'other'\n", "found: Mine, Other"),
        ("def broken(:\n", "failed to load: SyntaxError"),
        ("import no_such_module\n", "line 1, failed to load: ModuleNotFoundError"),
        ("\n\n1 / 0\n", "bad.py, line 3, failed to load: ZeroDivisionError: division by zero"),
        ("open('/nowhere/at/all')\n", "failed to load: FileNotFoundError"),
        ("import sys\nsys.exit(5)\n", "line 2, failed to load: it ends the program"),
        (SCRIPT.replace("name =", "title ="), "Mine needs a name"),
        (SCRIPT.replace("def command", "def comand"), "Mine lacks the method: command"),
        (SCRIPT + "    Config = dict\n", "Mine.Config must be a subclass of ScenarioConfig"),
    ],
)
def test_a_script_that_is_no_scenario_is_refused(tmp_path, text, message):
    file = tmp_path / "bad.py"
    file.write_text(text)
    with pytest.raises(ConfigurationError, match=message):
        find_scenario(str(file))


def test_a_missing_script_is_named():
    with pytest.raises(ConfigurationError, match="no scenario script 'nowhere/mine.py'"):
        find_scenario("nowhere/mine.py")
