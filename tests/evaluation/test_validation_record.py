"""Records are read back as they were written, or not at all."""

import os
import stat

import orjson
import pytest

from bluefoot_mpc.evaluation.validation_plan import Plan
from bluefoot_mpc.evaluation.validation_record import (
    RecordError,
    find_records,
    load_record,
    own_hash,
    record_file,
    records_folder,
    save_record,
)
from bluefoot_mpc.exceptions import ConfigurationError
from tests.evaluation.validated import CODE, made_up


def change(record, edit, rehash=False):
    table = orjson.loads(record.file.read_bytes())
    edit(table)
    if rehash:
        table["sha256"] = own_hash(table)
    record.file.write_bytes(orjson.dumps(table))


def test_a_record_reads_back_as_it_was(tmp_path):
    record = made_up(tmp_path)
    again = load_record(record.file)
    assert again.passed
    assert again.plan == Plan()
    assert again.table == orjson.loads(orjson.dumps(record.table))
    assert record.file.name.startswith(record.table["subject_sha256"][:16])
    assert b"\n" in record.file.read_bytes()[:80]  # for people, too


def test_a_failed_record_names_the_limits(tmp_path):
    record = load_record(made_up(tmp_path, falls=1.0).file)
    assert not record.passed
    assert record.broken[0] == "stand, sim: 1, wanted falls ≤ 0"


def test_unknown_figures_break_their_limits(tmp_path):
    record = made_up(tmp_path, emergency_ms=None)
    assert record.broken == [
        f"emergency stop, {robot}: not measured, wanted emergency_ms ≤ 100 ms"
        for robot in ("sim", "emulator")
    ]


@pytest.mark.parametrize(
    "edit",
    [
        lambda t: t.update(passed=False),
        lambda t: t["cases"][0]["figures"]["0"].update(falls=1.0),
        lambda t: t["subject"]["safety"].update(voltage_warn=9.0),
        lambda t: t["code"].update(source="mine"),
        lambda t: t["plan"].update(speed=0.4),
        lambda t: t.update(sha256="0" * 64),
    ],
)
def test_an_edited_record_is_refused(tmp_path, edit):
    record = made_up(tmp_path)
    change(record, edit)
    with pytest.raises(RecordError, match="does not fit its own hash"):
        load_record(record.file)


def test_a_new_hash_does_not_make_a_failure_pass(tmp_path):
    record = made_up(tmp_path, falls=1.0)
    change(record, lambda t: t.update(passed=True), rehash=True)
    with pytest.raises(RecordError, match="contradicts itself"):
        load_record(record.file)


@pytest.mark.parametrize("key", ["cases", "plan", "subject", "passed", "code", "made"])
@pytest.mark.parametrize("value", [None, 3, "x", [], [1], {}, {"a": []}])
def test_nonsense_with_the_right_hash_is_refused_too(tmp_path, key, value):
    record = made_up(tmp_path)
    change(record, lambda t: t.update({key: value}), rehash=True)
    if key == "made" or (key == "code" and isinstance(value, dict)):
        load_record(record.file)  # no date or code that anything would be compared with
        return
    with pytest.raises(RecordError):
        load_record(record.file)


def test_a_configuration_cannot_be_swapped(tmp_path):
    record = made_up(tmp_path)
    change(record, lambda t: t["subject"]["safety"].update(voltage_warn=9.0), rehash=True)
    with pytest.raises(RecordError, match="does not fit"):
        load_record(record.file)


@pytest.mark.parametrize(
    ("content", "why"),
    [
        (b"", "damaged"),
        (b'{"format": 1, "cas', "damaged"),
        (b"[]", "no record"),
        (b'{"passed": true}', "no rec"),
    ],
)
def test_what_is_no_record_is_refused(tmp_path, content, why):
    file = tmp_path / "x.json"
    file.write_bytes(content)
    with pytest.raises(RecordError, match=why):
        load_record(file)
    with pytest.raises(RecordError, match="cannot be read"):
        load_record(tmp_path / "missing.json")


def test_another_format_is_told(tmp_path):
    record = made_up(tmp_path)
    change(record, lambda t: t.update(format=99), rehash=True)
    with pytest.raises(RecordError, match="format 99"):
        load_record(record.file)


def test_plan_and_code_have_records_of_their_own(tmp_path):
    files = {
        made_up(tmp_path).file,
        made_up(tmp_path, plan=Plan(quick=True)).file,
        made_up(tmp_path, plan=Plan(speed=0.1)).file,
    }
    assert len(files) == 3
    assert set(find_records(tmp_path)) == files
    assert record_file(tmp_path, made_up(tmp_path).table) in files
    assert list(find_records(tmp_path / "none")) == []


def test_the_folder_is_asked_for_named_or_the_users_own(tmp_path, monkeypatch):
    monkeypatch.setenv("BLUEFOOT_RECORDS", str(tmp_path / "named"))
    assert records_folder(tmp_path) == tmp_path
    assert records_folder() == tmp_path / "named"
    monkeypatch.delenv("BLUEFOOT_RECORDS")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert records_folder() == tmp_path / ".local/share/bluefoot/validation"


def test_a_folder_that_cannot_be_written_is_told(tmp_path):
    record = made_up(tmp_path / "a")
    (tmp_path / "file").write_text("")
    with pytest.raises(ConfigurationError, match="cannot write the record"):
        save_record(tmp_path / "file", record.table)
    assert stat.S_ISREG(os.stat(tmp_path / "file").st_mode)


def test_code_is_noted_whole(tmp_path):
    assert made_up(tmp_path).table["code"] == CODE.as_plain()
