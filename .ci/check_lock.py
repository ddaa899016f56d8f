"""Check that requirements.lock satisfies pyproject.toml, is fully hashed, and names no address."""

from __future__ import annotations

import re
import sys
import tomllib
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).resolve().parents[1]
PIN = re.compile(r"^(?P<name>[A-Za-z0-9._-]+)==(?P<version>[^\s;\\]+)")


def wanted(pyproject: dict) -> list[Requirement]:
    """What the package and its development need, and the build back end."""
    project = pyproject["project"]
    lines = project["dependencies"] + project["optional-dependencies"]["dev"]
    return [Requirement(line) for line in lines + pyproject["build-system"]["requires"]]


def problems(lock: str, needs: list[Requirement]) -> list[str]:
    """Everything that is wrong with the text of a lock, one sentence each."""
    found = []
    pins: dict[str, list[str]] = {}
    for entry in re.split(r"(?<!\\)\n", lock):
        if match := PIN.match(entry):
            pins.setdefault(canonicalize_name(match["name"]), []).append(match["version"])
            if "--hash=sha256:" not in entry:
                found.append(f"{match['name']} has no hash")
        elif entry.strip() and not entry.lstrip().startswith("#"):
            found.append(f"not a pin: {entry.strip()[:80]}")
    if re.search(r"://|(^|\s)(-i|-f|--index-url|--extra-index-url|--find-links)\b", lock):
        found.append("an address stands in it")
    for need in needs:
        versions = pins.get(canonicalize_name(need.name), [])
        if not versions:
            found.append(f"{need.name} is missing")
        found += [f"{need.name} {v} does not fit '{need}'" for v in versions if v not in need.specifier]
    return found


def main() -> int:
    """Print what is wrong; 0 when nothing is."""
    pyproject = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    found = problems((ROOT / "requirements.lock").read_text(encoding="utf-8"), wanted(pyproject))
    for line in found:
        print(f"requirements.lock: {line} (make lock writes it anew)", file=sys.stderr)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
