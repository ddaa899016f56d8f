"""Running batteries: processes side by side, results kept on disk, so that a long job can go on later."""

from __future__ import annotations

import hashlib
import multiprocessing
import os
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path

import orjson

import bluefoot_mpc
from bluefoot_mpc.evaluation.cases import Case
from bluefoot_mpc.evaluation.limits import Limit
from bluefoot_mpc.evaluation.measure import Figures, measure
from bluefoot_mpc.model.resources import models_folder


@dataclass(frozen=True, kw_only=True, slots=True)
class Verdict:
    """A case's figures over its seeds.

    Attributes:
        case: what was run.
        figures: seed to figures.
    """

    case: Case
    figures: dict[int, Figures]

    def values(self, figure: str) -> list[float | None]:
        """A figure of every seed; None where it is unknown."""
        return [figures.get(figure) for figures in self.figures.values()]

    def value(self, limit: Limit) -> float | None:
        """What of the seeds is compared with the limit; None where that is unknown."""
        return limit.value(self.values(limit.figure))

    def holds(self, limit: Limit) -> bool:
        """True when the seeds keep the limit."""
        return limit.holds(self.values(limit.figure))

    @property
    def passed(self) -> bool:
        """True when every limit is kept."""
        return all(self.holds(limit) for limit in self.case.limits)


class Store:
    """Results on disk, one line each, kept as long as the code that made them is the same.

    Args:
        path: the file; None keeps nothing.
    """

    def __init__(self, path: Path | None) -> None:
        self._path = path
        self._version = source_hash()
        self._known: dict[str, Figures] = {}
        if path is not None and path.is_file():
            for line in path.read_bytes().splitlines():
                self._read(line)

    def get(self, case: Case, seed: int) -> Figures | None:
        """Figures of an earlier run, or None."""
        return self._known.get(self._key(case, seed))

    def put(self, case: Case, seed: int, figures: Figures) -> None:
        """Keep the figures of a run."""
        key = self._key(case, seed)
        self._known[key] = figures
        if self._path is not None:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            with self._path.open("ab") as file:
                # The newline comes first: a line that a killed job cut off spoils only itself.
                file.write(b"\n" + orjson.dumps({"key": key, "figures": figures}))

    def _read(self, line: bytes) -> None:
        try:
            entry = orjson.loads(line)
        except orjson.JSONDecodeError:
            return  # The last line of a job that was killed.
        self._known[entry["key"]] = entry["figures"]

    def _key(self, case: Case, seed: int) -> str:
        options = orjson.dumps(dict(case.options), option=orjson.OPT_SORT_KEYS).decode()
        turned = f" of {case.directions}" if case.directions else ""
        return f"{self._version} {case.scenario} {options} {seed}{turned}"


def source_hash() -> str:
    """Hash of the package's code and models: what results depend on."""
    digest = hashlib.sha256()
    package = Path(bluefoot_mpc.__file__).parent
    for path in sorted([*package.rglob("*.py"), *models_folder().glob("*.toml")]):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def run_battery(
    cases: Sequence[Case],
    store: Store,
    *,
    workers: int | None = None,
    progress: Callable[[Case, int], None] | None = None,
) -> list[Verdict]:
    """Run every seed of every case that is not in the store yet.

    Args:
        cases: what to run.
        store: earlier results; new ones are added as they come.
        workers: processes; None takes one per core.
        progress: called after every run.
    """
    missing = [(case, seed) for case in cases for seed in case.seeds if store.get(case, seed) is None]
    for case, seed, figures in _run_all(missing, workers or os.cpu_count() or 1):
        store.put(case, seed, figures)
        if progress is not None:
            progress(case, seed)
    return [
        Verdict(case=case, figures={seed: store.get(case, seed) or {} for seed in case.seeds})
        for case in cases
    ]


def _run_all(jobs: Sequence[tuple[Case, int]], workers: int) -> Iterable[tuple[Case, int, Figures]]:
    if workers == 1 or len(jobs) < 2:
        for case, seed in jobs:
            yield case, seed, measure(case, seed)
        return
    # Forked children would inherit threads of the linear algebra: start fresh ones.
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(max_workers=workers, mp_context=context) as pool:
        waiting = {pool.submit(measure, case, seed): (case, seed) for case, seed in jobs}
        for future in as_completed(waiting):
            yield (*waiting[future], future.result())
