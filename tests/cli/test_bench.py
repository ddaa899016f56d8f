"""``bluefoot bench`` on made-up runs: what it refuses, prints and writes."""

import json

import pytest

from bluefoot_mpc.cli import bench as bench_module
from bluefoot_mpc.cli import bench_plan
from bluefoot_mpc.cli.arguments import BenchCommand
from bluefoot_mpc.cli.main import main
from bluefoot_mpc.evaluation import battery as battery_module
from bluefoot_mpc.evaluation.level_ablation import SHOWN
from bluefoot_mpc.evaluation.level_cases import DEFAULT_CASES
from bluefoot_mpc.evaluation.timing import Timing
from tests.viz.html_check import PageReader

LAYERS = {
    "estimation": Timing(p50=150.0, p99=300.0, mean=160.0),
    "whole tick": Timing(p50=400.0, p99=600.0, mean=420.0),
}


@pytest.fixture
def runs(monkeypatch):
    """Runs that were asked for; mpc tilts half as much, pushes over 4 N·s make everybody fall."""
    seen = []

    def measure(case, seed):
        seen.append((case.name, case.options["controller"], seed))
        tilt = (0.2 + 0.01 * seed) * (0.5 if case.options["controller"] == "mpc" else 1.0)
        figures = {"roll_rms_deg": tilt, "pitch_rms_deg": tilt, "tilt_rms_deg": 1.4 * tilt}
        known = {"clearance_mm": 12.0, "speed_mmps": 100.0, "speed_error_percent": 1.0}
        estimate = {"attitude_error_deg": 0.1, "attitude_bias_deg": 0.05}
        fell = case.options.get("impulse", 0.0) > 4.0
        return {"falls": float(fell), **figures, **known, **estimate}

    monkeypatch.setattr(battery_module, "measure", measure)
    monkeypatch.setattr(bench_module, "time_layers", lambda scenario, runs, done: dict.fromkeys(runs, LAYERS))
    return seen


@pytest.fixture
def bench(capfd, tmp_path, runs):
    def run(*words):
        status = main(["bench", *words, "--workers", "1", "--out", str(tmp_path / "out"), "--json"])
        printed = capfd.readouterr()
        return status, json.loads(printed.out), printed.err

    return run


def test_an_ablation_is_printed_as_one_object_and_written(bench, tmp_path):
    status, data, err = bench("--cases", "trot-100,payload", "--seeds", "3")
    assert status == data["exit_status"] == 0
    assert data["success"]
    assert err == ""
    rows = {(row["case"], row["variant"]): row for row in data["ablation"]}
    ratio = rows[("payload", "mpc")]["against_first"]["tilt_rms_deg"]["ratio"]
    assert ratio["value"] == pytest.approx(0.5)
    assert data["timing"]["walk 30 mm/s"]["mpc"]["estimation"]["p50"] == 150.0
    written = json.loads((tmp_path / "out" / "bench.json").read_text())
    assert written["ablation"] == data["ablation"]


def test_a_missed_limit_is_exit_status_1_and_named(bench):
    # Nobody measured a ZMP or a plan: their limits cannot hold.
    status, data, _ = bench("--cases", "walk-30", "--seeds", "3", "--parts", "ablation")
    assert status == 1
    missed = {row["figure"] for row in data["criteria"] if not row["holds"]}
    assert {"zmp_inside_percent", "plan_margin_mm"} <= missed
    assert data["timing"] == {}


def test_a_bench_goes_on_where_it_stopped(bench, runs):
    words = ("--cases", "payload", "--seeds", "2", "--parts", "ablation")
    bench(*words)
    done = len(runs)
    bench(*words)
    assert len(runs) == done
    bench("--cases", "payload", "--seeds", "3", "--parts", "ablation")
    assert len(runs) == done * 3 // 2


def test_the_limit_of_pushes_is_looked_for_in_every_direction(bench):
    status, data, _ = bench("--parts", "pushes", "--seeds", "2")
    assert status == 0
    limits = data["pushes"]["mpc"]
    assert [limit["direction_deg"] for limit in limits] == [30.0 * k for k in range(12)]
    assert all(3.75 <= limit["least_ns"] <= 4.0 for limit in limits)


def test_the_page_opens_offline_and_the_terminal_shows_the_tables(runs, capfd, tmp_path):
    out = tmp_path / "out"
    words = ["bench", "--parts", "ablation,timing,pushes", "--cases", "payload", "--seeds", "3"]
    assert main([*words, "--workers", "1", "--out", str(out)]) == 0
    shown = capfd.readouterr()
    assert "0.50 [0.50, 0.50]" in shown.out
    assert "150 (300)" in shown.out
    assert shown.err == ""
    page = PageReader((out / "bench.html").read_text(encoding="utf-8"))
    assert page.open == []
    assert page.references == []
    assert {"tilt", "ratio", "pushes", "timing-0", "ablation", "limits"} <= set(page.ids)
    figures = json.loads(page.texts["figures"])
    assert figures["pushes"]["data"][0]["type"] == "scatterpolar"
    theta = figures["pushes"]["data"][0]["theta"]
    assert theta[0] == theta[-1]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--parts", "ablations"], "ablation, level, pushes, timing"),
        (["--cases", "walk-31"], "walk-30"),
        (["--cases", ","], "walk-30"),
        (["--variants", "cpq"], "cpg"),
        (["--seeds", "0"], "--seeds"),
        (["--seeds", "x"], "--seeds"),
        (["--duration", "0"], "--duration"),
        (["--workers", "0"], "--workers"),
        (["--case", "walk-30"], "--cases"),
    ],
)
def test_wrong_use_is_told_with_what_is_valid(runs, capfd, words, message):
    assert main(["bench", *words]) == 2
    assert message in capfd.readouterr().err
    assert runs == []


@pytest.fixture
def level_runs(monkeypatch):
    """Levelling that leaves half of the tilt, with the network a third."""
    seen = []

    def measure(case, seed):
        seen.append((case.name, seed))
        on = 1.0 if "control.leveling.psi=network" in case.options["overrides"] else 1.5
        figures = dict.fromkeys(SHOWN, 3.0)
        figures |= {f"on_{axis}_rms_deg": on + 0.01 * seed for axis in ("roll", "pitch", "tilt")}
        figures |= {
            f"{axis}_reduction_percent": 100.0 * (1.0 - on / 3.0) for axis in ("roll", "pitch", "tilt")
        }
        return {"falls": 0.0, "disengaged": 0.0, **figures}

    monkeypatch.setattr(battery_module, "measure", measure)
    return seen


def test_the_parts_of_levelling_are_one_command(capfd, tmp_path, level_runs):
    out = tmp_path / "out"
    words = ["bench", "--parts", "level", "--cases", "level-60,level-mpc-60", "--workers", "1"]
    words += ["--out", str(out)]
    assert main([*words, "--json"]) == 0
    data = json.loads(capfd.readouterr().out)
    assert {row["part"] for row in data["level"]["rows"]} == set(data["level"]["parts"])
    assert [credit["credited"] for credit in data["level"]["credits"]] == [True, True]
    assert data["variants"] == {}
    assert data["ablation"] == []
    done = len(level_runs)
    assert main(words) == 0
    assert len(level_runs) == done
    shown = capfd.readouterr().out
    assert "0.67 [0.67, 0.67]" in shown
    assert "2 of 2 cases" in shown.replace("\n", " ")
    assert max(map(len, shown.splitlines())) <= max(80, len(str(out)) + 20)
    page = PageReader((out / "bench.html").read_text(encoding="utf-8"))
    assert page.open == []
    assert page.references == []
    assert {"level-roll", "level-pitch", "level-credit", "level", "limits"} <= set(page.ids)
    assert "ablation" not in page.ids
    bars = json.loads(page.texts["figures"])["level-roll"]["data"]
    assert [bar["name"] for bar in bars] == ["mix", "pd", "narx", "always", "network", "persistence", "model"]
    assert bars[1]["y"] == [50.0, 50.0]


def plan(**words):
    return bench_plan.plan_of(BenchCommand(**words))


def test_each_part_takes_its_own_cases_and_rows():
    both = plan(parts="ablation,level", cases="payload,level-payload", variants="mpc,pd,narx")
    assert (list(both.cases), list(both.level_cases)) == (["payload"], ["level-payload"])
    assert [row.name for row in both.rows] == ["mpc"]
    assert [part.name for part in both.level_parts] == ["pd", "narx"]
    alone = plan(parts="level", variants="pd")
    assert alone.cases == {}
    assert list(alone.level_cases) == list(DEFAULT_CASES)
    assert not alone.needs_variants
    assert len(plan(parts="level", cases="all").level_cases) == 20
    # Cases that nobody asked for are left out where none of the rows is measured in them.
    for cases in (None, "all"):
        mixed = plan(parts="level", variants="mix", cases=cases).level_cases
        assert {case.options["controller"] for case in mixed.values()} == {"cpg"}
    assert list(plan(parts="ablation").cases) == list(bench_plan.ABLATION_CASES)
    assert plan(parts="ablation", duration=10.0).level_cases == {}


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--parts", "level", "--cases", "payload"], "level-payload"),
        (["--parts", "level", "--cases", "level-61"], "level-60"),
        (["--parts", "ablation,level", "--cases", "payload"], "no case of level"),
        (["--parts", "level", "--variants", "cpg"], "persistence"),
        (["--parts", "level", "--cases", "level-mpc-60", "--variants", "mix"], "Take some of: pd, narx"),
        (["--parts", "level", "--cases", "level-60,level-mpc-60", "--variants", "mix"], "level-mpc-60"),
        (["--parts", "level", "--duration", "20"], "take 34 or more"),
    ],
)
def test_wrong_use_of_the_part_level_is_told(level_runs, capfd, words, message):
    assert main(["bench", *words]) == 2
    assert message in capfd.readouterr().err
    assert level_runs == []


def test_full_asks_for_everything(capfd):
    command = BenchCommand(full=True, cases="payload", parts="timing", seeds=1)
    plan = bench_plan.plan_of(command)
    assert plan.parts == bench_plan.PARTS
    assert len(plan.cases) > 10
    assert len(plan.level_cases) > 10
    assert plan.pushes.seeds == bench_plan.FULL_SEEDS
    assert len(plan.cases["push-2"].seeds) == 240


def test_a_folder_that_cannot_be_written_is_named(runs, capfd, tmp_path):
    (tmp_path / "file").write_text("")
    assert main(["bench", "--parts", "timing", "--out", str(tmp_path / "file" / "x")]) == 2
    assert "--out" in capfd.readouterr().err
