"""What is recorded is in the file, whatever ends the run."""

from __future__ import annotations

import itertools
import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import orjson
import pytest
from mcap.reader import make_reader

from bluefoot_mpc.exceptions import LogError
from bluefoot_mpc.runtime import recorder as recording
from bluefoot_mpc.runtime.log import read_log
from bluefoot_mpc.runtime.recorder import BATCH, Recorder
from tests.runtime.made_up_run import CONFIG, PERIOD, iterate_ticks, make_run, record_ticks, same_runs

ROOT = Path(__file__).parents[2]


def test_a_run_comes_back_as_it_was(tmp_path: Path) -> None:
    run = make_run(120)
    with Recorder(tmp_path / "deep" / "log.mcap", CONFIG, PERIOD) as recorder:
        record_ticks(recorder, run)
        recorder.finish("completed", 12.5)
    log = read_log(tmp_path / "deep" / "log.mcap", strict=True)
    assert same_runs(log, run)
    assert not log.truncated
    assert (log.config, log.period, log.stop_reason, log.real_time_factor) == (
        CONFIG,
        PERIOD,
        "completed",
        12.5,
    )
    assert log.versions == run.versions


def test_an_independent_reader_understands_the_file(tmp_path: Path) -> None:
    run = make_run(60)
    pictures = sum(frame.camera is not None for frame in run.frames)
    with Recorder(tmp_path / "log.mcap", CONFIG) as recorder:
        record_ticks(recorder, run)
    with (tmp_path / "log.mcap").open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None
        topics = {channel.topic: channel for channel in summary.channels.values()}
        assert set(topics) == {"/frame", "/camera", "/command", "/telemetry", "/truth", "/config"}
        assert {channel.message_encoding for channel in topics.values()} == {"json"}
        for schema in summary.schemas.values():
            assert schema.encoding == "jsonschema"
            assert orjson.loads(schema.data)["type"] == "object"
        assert summary.statistics is not None
        assert summary.statistics.message_count == 4 * 60 + 1 + pictures
        for _, channel, message in reader.iter_messages():
            data = orjson.loads(message.data)
            if channel.topic == "/camera":
                assert message.log_time == round(data["frame"] * 1e9)
            elif channel.topic != "/config":
                assert message.log_time == round(data["time"] * 1e9)


@pytest.mark.parametrize("error", [ValueError("a bug"), KeyboardInterrupt()])
def test_an_exception_leaves_a_complete_log(tmp_path: Path, error: BaseException) -> None:
    run = make_run(40)

    def interrupted_run() -> None:
        with Recorder(tmp_path / "log.mcap", CONFIG) as recorder:
            for k in iterate_ticks(recorder, run):
                if k == 29:
                    raise error

    with pytest.raises(type(error)):
        interrupted_run()
    log = read_log(tmp_path / "log.mcap", strict=True)
    assert [len(log.records(topic)) for topic in ("frame", "command", "telemetry", "truth")] == [30] * 4
    assert type(error).__name__ in log.stop_reason


def test_a_run_without_a_tick_leaves_its_configuration(tmp_path: Path) -> None:
    with Recorder(tmp_path / "log.mcap", CONFIG):
        pass
    log = read_log(tmp_path / "log.mcap", strict=True)
    assert log.config == CONFIG
    assert log.frames == []


def test_closing_twice_is_harmless(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "log.mcap", CONFIG)
    recorder.close()
    recorder.close()


CHILD = """
import sys, time
from bluefoot_mpc.runtime.recorder import Recorder
from tests.runtime.made_up_run import CONFIG, iterate_ticks, make_run
recorder = Recorder(sys.argv[1], CONFIG, 0.02)
for k in iterate_ticks(recorder, make_run(int(sys.argv[2]))):
    print(k, flush=True)
    time.sleep(0.0005)
"""


def child(log: Path, ticks: int) -> subprocess.Popen[str]:
    command = [sys.executable, "-c", CHILD, str(log), str(ticks)]
    return subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, env=os.environ.copy())


def test_a_killed_process_loses_less_than_a_second(tmp_path: Path) -> None:
    with child(tmp_path / "log.mcap", 5000) as process:
        assert process.stdout is not None
        for line in itertools.islice(process.stdout, 201):
            done = int(line)
        process.send_signal(signal.SIGKILL)
    log = read_log(tmp_path / "log.mcap")
    assert log.truncated
    assert log.config == CONFIG
    assert len(log.truth) >= done - (2.0 * BATCH / PERIOD)
    assert same_runs_up_to(log, done)


def same_runs_up_to(log, done: int) -> bool:  # type: ignore[no-untyped-def]
    whole = make_run(done + 200)
    count = len(log.truth)
    for topic in ("frame", "command", "telemetry", "truth"):
        del whole.records(topic)[count:], log.records(topic)[count:]
    return same_runs(log, whole)


def test_a_process_that_forgets_to_close_leaves_a_complete_log(tmp_path: Path) -> None:
    with child(tmp_path / "log.mcap", 40) as process:
        process.communicate()
    assert process.returncode == 0
    assert len(read_log(tmp_path / "log.mcap", strict=True).frames) == 40


def test_a_command_needs_a_frame(tmp_path: Path) -> None:
    record = make_run(1).commands[0]
    with (
        Recorder(tmp_path / "log.mcap", CONFIG) as recorder,
        pytest.raises(LogError, match="before any frame"),
    ):
        recorder.command(record.motion, record.joints, record.safety)


def test_a_file_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    (tmp_path / "plain").write_text("a file, no folder")
    with pytest.raises(LogError, match=r"cannot write the log .*plain/log\.mcap"):
        Recorder(tmp_path / "plain" / "log.mcap", CONFIG)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is always full")
def test_a_full_disk_is_reported(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="No space left"):
        Recorder("/dev/full", CONFIG)


def test_a_disk_that_fills_up_during_the_run_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = make_run(200)
    recorder = Recorder(tmp_path / "log.mcap", CONFIG)

    def full() -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(recorder._writer, "flush", full)
    with pytest.raises(LogError, match="No space left"), recorder:
        record_ticks(recorder, run)


def test_what_goes_wrong_in_the_thread_is_told_and_blocks_nobody(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: object) -> bytes:
        raise ValueError("a bug")

    monkeypatch.setattr(recording.packed_pictures, "pack", broken)
    # More half seconds than the queue holds.
    run = make_run(2000)
    recorder = Recorder(tmp_path / "log.mcap", CONFIG)
    with pytest.raises(LogError, match="cannot write the log .*ValueError: a bug"), recorder:
        record_ticks(recorder, run)


def test_a_slow_disk_does_not_fill_the_memory_with_raw_pictures(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = make_run(400)
    sizes = [frame.camera.pixels.nbytes for frame in run.frames if frame.camera is not None]
    monkeypatch.setattr(recording, "_RAW_LIMIT", 3 * max(sizes))
    goes_on = threading.Event()
    with Recorder(tmp_path / "log.mcap", CONFIG, PERIOD) as recorder:
        write = recorder._writer.add_message

        def slow(*message: object) -> None:
            goes_on.wait(30.0)
            write(*message)

        monkeypatch.setattr(recorder._writer, "add_message", slow)
        record_ticks(recorder, run)
        waiting = sum(raw_pictures(recorder))
        goes_on.set()
    assert len(sizes) > 10
    assert waiting <= 3 * max(sizes)
    # Packed early or late, every picture is there.
    assert same_runs(read_log(tmp_path / "log.mcap", strict=True), run)
    assert recorder._raw_in == recorder._raw_out > 0


def raw_pictures(recorder: Recorder) -> list[int]:
    """Bytes of each picture that waits unpacked, but for the half second that is being written."""
    waiting = [data for batch in recorder._queue.queue if batch for _, _, data in batch]
    waiting += [data for _, _, data in recorder._batch] + [record for _, _, record in recorder._portion]
    return [data.image.pixels.nbytes for data in waiting if isinstance(data, recording._Picture)]
