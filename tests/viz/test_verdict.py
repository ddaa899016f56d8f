from __future__ import annotations

from bluefoot_mpc.viz.verdict import facts, number, tiles, verdict

from .synthetic_run import make_summary


def by_label(summary: dict[str, object]) -> dict[str, object]:
    return {tile.label: tile for tile in tiles(summary, 1.5, 0.02)}


def test_good_walk() -> None:
    judged = verdict(make_summary())
    assert (judged.status, judged.word, judged.mark) == ("good", "Success", "✓")
    assert {tile.status for tile in tiles(make_summary(), 1.5, 0.02)} == {"good", ""}


def test_each_missed_goal_turns_its_own_tile() -> None:
    cases = {
        "Attitude error, RMS": {"attitude_error_rms_deg": 0.31},
        "Torque, peak": {"torque_peak_nm": 1.6},
        "Hottest servo": {"servo_temp_max_c": 66.0},
        "Tick, 99 %": {"tick_us": {"p99": 20001.0}},
        "Deadline misses": {"deadline_misses": 1},
        "QP failures": {"qp_failures": 2},
    }
    for label, change in cases.items():
        bad = [tile.label for tile in tiles(make_summary(**change), 1.5, 0.02) if tile.status == "bad"]
        assert bad == [label]


def test_the_criteria_judge_their_figures_and_nothing_else_does() -> None:
    figures = {
        "Speed": "speed_mps",
        "Sideways drift": "lateral_drift_m",
        "Roll, RMS": "roll_rms_deg",
        "Pitch, RMS": "pitch_rms_deg",
        "Pitch, peak": "pitch_peak_deg",
        "Swing clearance": "swing_clearance_median_m",
    }
    unjudged = by_label(make_summary())
    assert all(unjudged[label].status == "" for label in figures if label in unjudged)
    for label, figure in figures.items():
        for holds, status in ((True, "good"), (False, "bad")):
            check = {"name": "n", "holds": holds, "detail": "d", "figure": figure, "goal": "≤ 7 of them"}
            tile = {t.label: t for t in tiles(make_summary(), 1.5, 0.02, [check])}[label]
            assert (tile.status, tile.note) == (status, "≤ 7 of them")


def test_standing_has_no_way_tiles() -> None:
    labels = by_label(make_summary(scenario="stand", speed_ref_mps=0.0, speed_mps=0.0))
    assert "Speed" not in labels
    assert "Roll, RMS" in labels


def test_bad_outcomes() -> None:
    checks = [
        {"name": "drift under 10 % of the distance", "holds": False, "detail": "+0.5 m over 2 m"},
        {"name": "stays on its feet", "holds": True, "detail": "yes"},
    ]
    missed = verdict(make_summary(success=False), checks)
    assert missed.headline == "The robot walked, but missed one of its criteria"
    assert missed.explanation == "Drift under 10 % of the distance: +0.5 m over 2 m."
    assert verdict(make_summary(stop_reason="interrupted")).status == "warn"
    stopped = verdict(make_summary(stop_reason="servo FL_knee is hot"))
    assert (stopped.status, stopped.explanation) == ("bad", "Servo FL_knee is hot.")


def test_numbers_read_well() -> None:
    assert number(-0.04, 1) == "0.0"
    assert number(-1.25, 1) == "\u22121.2"
    assert number(None, 2) == number(float("nan"), 2) == "–"
    assert number(0.0104, 1, 1e3) == "10.4"


def test_facts_leave_out_what_is_unknown() -> None:
    names = [name for name, _ in facts(make_summary(gait=None, real_time_factor=None))]
    assert names == ["scenario", "controller", "robot", "seed", "duration", "configuration"]
