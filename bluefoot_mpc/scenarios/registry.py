"""Scenarios by name, and scenarios from a user's script."""

from __future__ import annotations

import importlib.util
import sys
import traceback
from pathlib import Path

from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError
from bluefoot_mpc.scenarios.base import Scenario, ScenarioConfig
from bluefoot_mpc.scenarios.crossing import Rough
from bluefoot_mpc.scenarios.leveling import Level
from bluefoot_mpc.scenarios.navigating import Goto, Wander
from bluefoot_mpc.scenarios.posing import Pose, Stand
from bluefoot_mpc.scenarios.remote import Remote
from bluefoot_mpc.scenarios.seeking import Approach, Follow
from bluefoot_mpc.scenarios.sweeping import Sweep
from bluefoot_mpc.scenarios.walking import Push, Transition, Turn, Walk

SHIPPED: dict[str, type[Scenario]] = {
    scenario.name: scenario
    for scenario in (
        Stand,
        Pose,
        Walk,
        Turn,
        Transition,
        Push,
        Level,
        Wander,
        Goto,
        Approach,
        Follow,
        Sweep,
        Rough,
        Remote,
    )
}


def scenario_names() -> dict[str, str]:
    """Names of the scenarios that ship, with one line each."""
    return {name: scenario.describe() for name, scenario in SHIPPED.items()}


def find_scenario(name_or_path: str) -> type[Scenario]:
    """The scenario of a name, or the one that a user's Python file defines.

    Raises:
        UnknownNameError: there is no scenario of that name.
        ConfigurationError: the file is missing, fails to load, or defines no scenario or several.
    """
    if name_or_path in SHIPPED:
        return SHIPPED[name_or_path]
    if name_or_path.endswith(".py") or "/" in name_or_path:
        return _from_script(Path(name_or_path))
    raise UnknownNameError("scenario", name_or_path, SHIPPED)


def _from_script(path: Path) -> type[Scenario]:
    if not path.is_file():
        raise ConfigurationError(f"no scenario script '{path}'; scenarios that ship: {', '.join(SHIPPED)}")
    module_name = f"bluefoot_user_{path.stem}"
    spec = importlib.util.spec_from_file_location(module_name, path)
    if spec is None or spec.loader is None:
        raise ConfigurationError(f"'{path}' is not a Python file")
    module = importlib.util.module_from_spec(spec)
    # Dataclasses look their module up by name while it is being executed.
    sys.modules[module_name] = module
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:  # Whatever is wrong in it, it is the user's own code.
        raise ConfigurationError(f"{_place(path, error)} failed to load: {_what(error)}") from error
    found = [
        value
        for value in vars(module).values()
        if isinstance(value, type) and issubclass(value, Scenario) and value.__module__ == module_name
    ]
    if len(found) != 1:
        names = ", ".join(scenario.__name__ for scenario in found) or "none"
        raise ConfigurationError(f"{path} must define exactly one subclass of Scenario; found: {names}")
    _require_complete(found[0], path)
    return found[0]


def _require_complete(scenario: type[Scenario], path: Path) -> None:
    name = getattr(scenario, "name", None)
    if not isinstance(name, str) or not name or "/" in name:
        raise ConfigurationError(
            f'{path}: {scenario.__name__} needs a name: a class attribute, name = "my_scenario"'
        )
    missing = ", ".join(sorted(getattr(scenario, "__abstractmethods__", ())))
    if missing:
        raise ConfigurationError(f"{path}: {scenario.__name__} lacks the method: {missing}")
    if not (isinstance(scenario.Config, type) and issubclass(scenario.Config, ScenarioConfig)):
        raise ConfigurationError(f"{path}: {scenario.__name__}.Config must be a subclass of ScenarioConfig")


def _place(path: Path, error: BaseException) -> str:
    """The script, and the line in it that was being executed."""
    frames = traceback.extract_tb(error.__traceback__)
    lines = [frame.lineno for frame in frames if Path(frame.filename).resolve() == path.resolve()]
    return f"{path}, line {lines[-1]}," if lines else str(path)


def _what(error: BaseException) -> str:
    if isinstance(error, SystemExit):
        return "it ends the program (sys.exit) while it is loaded"
    return f"{type(error).__name__}: {error}".rstrip(": ")
