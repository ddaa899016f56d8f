"""Which message leaves next, and how much of the line is used."""

import pytest

from bluefoot_mpc.io.station.schedule import Schedule, Stream, TokenBucket

STREAMS = (
    Stream(name="beat", rate=1.0, urgent=True),
    Stream(name="fast", rate=25.0),
    Stream(name="slow", rate=5.0),
)


def counts(bucket, size, seconds=100.0, step=0.004):
    schedule, seen = Schedule(STREAMS, 0.0), dict.fromkeys(("beat", "fast", "slow"), 0)
    for tick in range(round(seconds / step)):
        now = tick * step
        while bucket.level(now) > 0.0 and (name := schedule.next(now)) is not None:
            schedule.done(name, now)
            bucket.take(size)
            seen[name] += 1
    return seen


def test_every_stream_has_its_rate_on_a_free_line():
    seen = counts(TokenBucket(1e9, 1e9), 40)
    assert seen == {"beat": pytest.approx(100, abs=1), "fast": pytest.approx(2500, abs=30), "slow": 500}


def test_on_a_slow_line_all_slow_down_alike_but_the_urgent():
    # 31 messages a second are wanted; 16 have room.
    seen = counts(TokenBucket(16 * 40, 80), 40)
    assert seen["beat"] == pytest.approx(100, abs=1)
    assert seen["fast"] == pytest.approx(1250, rel=0.25)
    assert seen["slow"] == pytest.approx(250, rel=0.25)
    assert sum(seen.values()) == pytest.approx(1600, rel=0.02)


def test_the_mean_rate_holds_whatever_the_sizes_are():
    bucket, sent, now = TokenBucket(1000.0, 100.0), 0, 0.0
    while now < 50.0:
        if bucket.level(now) > 0.0:
            bucket.take(279)
            sent += 279
        now += 0.003
    assert sent == pytest.approx(50_000, rel=0.01)


def test_what_was_missed_is_not_made_up_for():
    schedule = Schedule([Stream(name="fast", rate=25.0)], 0.0)
    assert schedule.next(10.0) == "fast"
    schedule.done("fast", 10.0)
    assert schedule.next(10.001) is None
    assert schedule.next(10.04) == "fast"


def test_a_stream_can_be_hurried():
    schedule = Schedule(STREAMS, 0.0)
    for name in ("beat", "fast", "slow"):
        schedule.done(name, 1.0)
    assert schedule.next(1.0) is None
    schedule.hurry("beat", 1.0)
    assert schedule.next(1.0) == "beat"
    assert schedule.wait(1.0) == 0.0


def test_waiting_ends_when_there_is_room():
    bucket = TokenBucket(100.0, 50.0)
    assert bucket.wait(0.0) == 0.0
    bucket.take(70)
    assert bucket.wait(0.0) == pytest.approx(0.2)
    assert bucket.level(0.2 + bucket.wait(0.2) + 1e-9) >= 0.0
