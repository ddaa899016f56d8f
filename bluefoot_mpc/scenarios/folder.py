"""The folder of a run: its files, and what can go wrong with them."""

from __future__ import annotations

import itertools
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from bluefoot_mpc.exceptions import ConfigurationError, LogError
from bluefoot_mpc.leveling.narx import NarxWeights, save_weights
from bluefoot_mpc.runtime.clouds import run_cloud
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.scenarios.options import RunOptions
from bluefoot_mpc.terrain.cloud_files import write_cloud

LOG, SUMMARY, REPORT, CONFIG = "log.mcap", "summary.json", "report.html", "config.toml"
"""Files that every run writes."""
WEIGHTS, START_WEIGHTS = "narx.npz", "narx_start.npz"
"""What the levelling network has learnt, and, where it was loaded, what it began with."""
CLOUD = "cloud.ply"
"""What the LIDAR met of rough ground, where the robot looked at it."""
FILES = (LOG, SUMMARY, REPORT, CONFIG, WEIGHTS, START_WEIGHTS, CLOUD)


def make_folder(options: RunOptions, scenario: str) -> Path:
    """The folder of a run: the one asked for, without an earlier run's results, or a new one."""
    folder = options.out or Path("runs") / f"{time.strftime('%Y%m%d-%H%M%S')}-{scenario}"
    try:
        if options.out is None:
            return _new_folder(folder)
        folder.mkdir(parents=True, exist_ok=True)
        for name in FILES:
            (folder / name).unlink(missing_ok=True)
    except OSError as error:
        raise ConfigurationError(f"cannot write to --out {folder}: {error.strerror or error}") from error
    return folder


def _new_folder(wanted: Path) -> Path:
    """A folder that nobody else has: two runs may start in the same second."""
    wanted.parent.mkdir(parents=True, exist_ok=True)
    for number in itertools.count(1):
        folder = wanted if number == 1 else wanted.with_name(f"{wanted.name}-{number}")
        with suppress(FileExistsError):
            folder.mkdir()
            break
    return folder


def keep_weights(weights: NarxWeights | None, file: Path) -> None:
    """Write a network's weights, where there are any.

    Raises:
        ConfigurationError: the file cannot be written.
    """
    if weights is not None:
        with writing(file):
            save_weights(file, weights)


def keep_cloud(run: RunData, file: Path) -> None:
    """Write what a run's LIDAR met of the ground, where it met any.

    Raises:
        CloudFileError: the file cannot be written.
    """
    cloud = run_cloud(run.telemetry, run.frames)
    if len(cloud.time):
        write_cloud(file, cloud)


def start_weights(folder: Path) -> str:
    """The weights that a recorded run began with.

    Args:
        folder: where its log lies.

    Raises:
        LogError: the file is no longer beside the log.
    """
    file = folder / START_WEIGHTS
    if not file.is_file():
        raise LogError(
            f"the run's levelling network began with weights that were loaded; {START_WEIGHTS}, which "
            f"was kept beside its log, is not in {folder}: put it back"
        )
    return str(file)


@contextmanager
def writing(file: Path) -> Iterator[None]:
    """Turn what hinders writing a file into one message; half a file is not left behind."""
    try:
        yield
    except BaseException as error:
        with suppress(OSError):
            file.unlink()
        if isinstance(error, OSError):
            raise ConfigurationError(f"cannot write {file}: {error.strerror or error}") from error
        raise


@contextmanager
def log_in(folder: Path) -> Iterator[None]:
    """Tell with any error where the log lies that was written until then."""
    try:
        yield
    except BaseException as error:
        if (folder / LOG).is_file():
            error.add_note(f"the log, as far as it goes, is in {folder / LOG}")
        raise
