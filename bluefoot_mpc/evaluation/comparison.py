"""Two controllers on the same seeds: how much less one tilts than the other, and how sure that is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import binomtest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.types import FloatArray

RESAMPLES = 10_000
CONFIDENCE = 0.95
MIN_PAIRS = 3
"""Fewer pairs give no interval that means anything."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Interval:
    """An estimate and the interval that holds it.

    Attributes:
        value: of the sample.
        low: lower end.
        high: upper end.
    """

    value: float
    low: float
    high: float


@dataclass(frozen=True, kw_only=True, slots=True)
class Comparison:
    """One figure of two controllers, seed by seed.

    Attributes:
        figure: which.
        pairs: seeds that count: those where both have the figure and neither fell.
        left_out: seeds that do not.
        ratio: geometric mean over the seeds of ours over theirs; None with too few pairs, or a zero.
        difference: mean over the seeds of ours less theirs; None with too few pairs.
    """

    figure: str
    pairs: int
    left_out: int
    ratio: Interval | None
    difference: Interval | None

    def reduces_by(self, part: float) -> bool:
        """True when the ratio is at most ``1 - part``; its interval is not asked."""
        return self.ratio is not None and self.ratio.value <= 1.0 - part


def compare(
    figure: str,
    ours: Mapping[int, Mapping[str, float | None]],
    theirs: Mapping[int, Mapping[str, float | None]],
    rng: np.random.Generator,
) -> Comparison:
    """Compare a figure of two controllers on the seeds that both ran.

    Runs that fell are left out on both sides: what a figure says of a robot on
    the ground is no measure of its tilt. Count the falls beside it.

    Args:
        figure: key of the figures.
        ours: seed to figures.
        theirs: seed to figures.
        rng: draws the resamples.

    Raises:
        ConfigurationError: the two did not run the same seeds.
    """
    if ours.keys() != theirs.keys():
        raise ConfigurationError(f"not the same seeds: {sorted(ours)} and {sorted(theirs)}")
    found = [_pair(figure, ours[seed], theirs[seed]) for seed in sorted(ours)]
    pairs = np.array([pair for pair in found if pair is not None], dtype=np.float64).reshape(-1, 2)
    ratio = difference = None
    if len(pairs) >= MIN_PAIRS:
        difference = bootstrap_mean(pairs[:, 0] - pairs[:, 1], rng)
        if (pairs > 0.0).all():
            logs = bootstrap_mean(np.log(pairs[:, 0] / pairs[:, 1]), rng)
            ratio = Interval(
                value=float(np.exp(logs.value)), low=float(np.exp(logs.low)), high=float(np.exp(logs.high))
            )
    return Comparison(
        figure=figure, pairs=len(pairs), left_out=len(found) - len(pairs), ratio=ratio, difference=difference
    )


@dataclass(frozen=True, kw_only=True, slots=True)
class Shares:
    """How often each of two succeeded on the same seeds.

    Attributes:
        both: seeds on which both did.
        ours: seeds on which only ours did.
        theirs: seeds on which only theirs did.
        neither: seeds on which neither did.
        difference: share of ours less share of theirs.
        chance: probability of so uneven an outcome where both are as good (exact, McNemar).
    """

    both: int
    ours: int
    theirs: int
    neither: int
    difference: Interval
    chance: float


def compare_shares(ours: Mapping[int, bool], theirs: Mapping[int, bool], rng: np.random.Generator) -> Shares:
    """Compare how often two succeed, seed by seed.

    Args:
        ours: seed to success.
        theirs: seed to success.
        rng: draws the resamples.

    Raises:
        ConfigurationError: the two did not run the same seeds.
    """
    if ours.keys() != theirs.keys() or not ours:
        raise ConfigurationError(f"not the same seeds, or none: {sorted(ours)} and {sorted(theirs)}")
    mine = np.array([ours[seed] for seed in sorted(ours)])
    other = np.array([theirs[seed] for seed in sorted(ours)])
    only_mine, only_other = int((mine & ~other).sum()), int((other & ~mine).sum())
    uneven = only_mine + only_other
    return Shares(
        both=int((mine & other).sum()), ours=only_mine, theirs=only_other,
        neither=int((~mine & ~other).sum()),
        difference=bootstrap_mean(mine.astype(float) - other, rng),
        chance=float(binomtest(only_mine, uneven).pvalue) if uneven else 1.0,
    )  # fmt: skip


def bootstrap_mean(
    values: Sequence[float] | FloatArray, rng: np.random.Generator, confidence: float = CONFIDENCE
) -> Interval:
    """Mean of a sample with its bootstrap percentile interval.

    Args:
        values: (n,) the sample.
        rng: draws the resamples.
        confidence: probability that the interval is to hold.
    """
    sample = np.asarray(values, dtype=np.float64)
    drawn = rng.integers(len(sample), size=(RESAMPLES, len(sample)))
    means = sample[drawn].mean(axis=1)
    tail = 50.0 * (1.0 - confidence)
    low, high = np.percentile(means, [tail, 100.0 - tail])
    return Interval(value=float(sample.mean()), low=float(low), high=float(high))


def _pair(
    figure: str, ours: Mapping[str, float | None], theirs: Mapping[str, float | None]
) -> tuple[float, float] | None:
    if ours.get("falls") or theirs.get("falls"):
        return None
    mine, other = ours.get(figure), theirs.get(figure)
    return None if mine is None or other is None else (mine, other)
