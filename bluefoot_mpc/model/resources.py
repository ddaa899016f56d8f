"""Where models and scenes lie: in the checkout, or inside the installed wheel."""

from __future__ import annotations

from pathlib import Path

from bluefoot_mpc.exceptions import ConfigurationError

_PACKAGE = Path(__file__).resolve().parents[1]


def models_folder() -> Path:
    """The folder of the shipped models: the checkout's, else the wheel's copy."""
    checkout = _PACKAGE.parent / "models"
    return checkout if (checkout / "bluefoot.toml").is_file() else _PACKAGE / "_data" / "models"


def model_file(name: str | Path) -> Path:
    """Path of a parameter file, given a path or the bare name of a shipped one.

    Raises:
        ConfigurationError: neither exists; the message lists what ships.
    """
    given = Path(name)
    shipped = models_folder() / f"{given.name}.toml"
    if str(name) == shipped.stem and _is_file(shipped):
        return shipped
    if _is_file(given):
        return given
    names = ", ".join(sorted(path.stem for path in models_folder().glob("*.toml")))
    raise ConfigurationError(f"no parameter file '{name}': give a path to a TOML file, or one of: {names}")


def _is_file(path: Path) -> bool:
    """Whether a file can be found there; a name that no file system takes is none."""
    try:
        return path.is_file()
    except OSError:
        return False
