"""What is validated: a configuration without the place where it runs, and the code that runs it."""

from __future__ import annotations

import dataclasses
import hashlib
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

import orjson

import bluefoot_mpc
from bluefoot_mpc.evaluation.battery import source_hash
from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.model.resources import models_folder
from bluefoot_mpc.runtime.versions import installed_versions
from bluefoot_mpc.scenarios import RunOptions
from bluefoot_mpc.scenarios.base import Scenario
from bluefoot_mpc.scenarios.config import Resolved, resolve
from bluefoot_mpc.scenarios.posing import Stand
from bluefoot_mpc.settings import dump_toml, read_toml, to_table

SECTIONS = ("control", "safety", "devices", "model")
"""Parts of a configuration that go to the robot."""
PLACES = ("ports", "board_port", "lidar_port", "camera", "calibration", "link", "faults")
"""Keys of [devices] that say where the devices are, or how they are emulated: no matter of validation."""
_BENCH = ("sim", "scenario", "drawn")
"""Sections of a run's config.toml that describe the test bench; validation brings its own."""
_SOLVERS = ("pin", "casadi", "numpy", "scipy", "daqp", "proxsuite", "qpsolvers")
"""Packages whose version can change what the controller commands."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Subject:
    """A configuration under test.

    Attributes:
        controller: name of the controller.
        table: its sections (`SECTIONS`) as nested tables, without `PLACES`.
    """

    controller: str
    table: Mapping[str, Any]

    def identity(self) -> dict[str, Any]:
        """What the hash is of: the tables, files that they name by their content.

        Raises:
            ConfigurationError: a file with weights cannot be read.
        """
        table = {"controller": self.controller, **self.table}
        control = self.table["control"]
        leveling = dict(control["leveling"])
        weights = leveling.pop("weights", "")
        # A network that does not begin with a file is the same wherever the file lies.
        if weights and leveling["enabled"] and leveling["psi"] == "network":
            leveling["weights_sha256"] = _file_hash(Path(weights))
        return {**table, "control": {**control, "leveling": leveling}}

    @property
    def sha256(self) -> str:
        """Hash of the identity."""
        return table_hash(self.identity())

    def write(self, file: Path) -> None:
        """Write a configuration file that runs this configuration.

        Raises:
            ConfigurationError: it cannot be written.
        """
        table = {"run": {"controller": self.controller}, **self.table}
        try:
            file.write_text(dump_toml(table), encoding="utf-8")
        except OSError as error:
            raise ConfigurationError(f"cannot write {file}: {error.strerror or error}") from error


@dataclass(frozen=True, kw_only=True, slots=True)
class Code:
    """The code that was validated.

    Attributes:
        package: version of this package.
        source: hash of its modules and models.
        versions: of the packages that can change a command.
        files: hash of every module and model, to name those that changed.
    """

    package: str
    source: str
    versions: Mapping[str, str]
    files: Mapping[str, str]

    def as_plain(self) -> dict[str, Any]:
        """Plain values, for a record."""
        return {**self._identity(), "files": dict(self.files)}

    @property
    def sha256(self) -> str:
        """Hash of all that makes it this code."""
        return table_hash(self._identity())

    def _identity(self) -> dict[str, Any]:
        return {"package": self.package, "source": self.source, "versions": dict(self.versions)}


def code_now() -> Code:
    """The code that runs."""
    versions = {}
    for name in _SOLVERS:
        try:
            versions[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    package = installed_versions()["bluefoot-mpc"]
    return Code(package=package, source=source_hash(), versions=versions, files=_file_hashes())


def subject_of(options: RunOptions, scenario: type[Scenario] = Stand) -> Subject:
    """The configuration that a run with these options would put on the robot.

    Args:
        options: of a run; what they say of simulator and ports has no effect.
        scenario: what would be run: a scenario may change the controller's configuration.

    Raises:
        ConfigurationError: a key is unknown, or a value impossible.
    """
    return subject_in(resolve_for_robot(scenario, options))


def subject_in(resolved: Resolved) -> Subject:
    """The configuration under test in a resolved one."""
    stages = to_table(resolved.stages)
    devices = {key: value for key, value in stages["devices"].items() if key not in PLACES}
    table = {
        "control": stages["control"], "safety": stages["safety"], "devices": devices,
        "model": to_table(resolved.parameters),
    }  # fmt: skip
    return Subject(controller=resolved.run.controller, table=_plain(table))


def resolve_for_robot(scenario: type[Scenario], options: RunOptions) -> Resolved:
    """Resolve a configuration without what its file says of the test bench: simulator, scenario, draw.

    So the ``config.toml`` of any run can be validated and deployed, whatever it ran.

    Raises:
        ConfigurationError: the file is missing, a key is unknown, or a value impossible.
    """
    with _without_bench(options) as stripped:
        return resolve(scenario, stripped)


def table_hash(table: Mapping[str, Any]) -> str:
    """Hash of a nested table of plain values, the same in any order of keys."""
    return hashlib.sha256(orjson.dumps(dict(table), option=orjson.OPT_SORT_KEYS)).hexdigest()


@contextmanager
def _without_bench(options: RunOptions) -> Iterator[RunOptions]:
    if options.config is None:
        yield options
        return
    table = {key: value for key, value in read_toml(options.config).items() if key not in _BENCH}
    with tempfile.TemporaryDirectory(prefix="bluefoot-") as folder:
        # The same name: messages show it.
        file = Path(folder) / options.config.name
        file.write_text(dump_toml(table), encoding="utf-8")
        yield dataclasses.replace(options, config=file)


def _file_hashes() -> dict[str, str]:
    """Short hash of everything that `source_hash` is of, by path."""
    package, models = Path(bluefoot_mpc.__file__).parent, models_folder()
    places = [(package, "*.py"), (models, "*.toml")]
    return {
        str(Path(folder.name) / file.relative_to(folder)): _file_hash(file)[:12]
        for folder, pattern in places
        for file in sorted(folder.rglob(pattern))
    }


def _file_hash(file: Path) -> str:
    try:
        return hashlib.sha256(file.read_bytes()).hexdigest()
    except OSError as error:
        raise ConfigurationError(f"cannot read {file}: {error.strerror or error}") from error


def _plain(value: Any) -> Any:
    """Lists for tuples, as JSON and TOML give them back."""
    if isinstance(value, Mapping):
        return {key: _plain(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(entry) for entry in value]
    return value
