"""What the controller reported, and its changes of gait, in order."""

from dataclasses import replace

from bluefoot_mpc.runtime.data import happenings
from bluefoot_mpc.types import Mode
from tests.runtime.made_up_run import make_run


def test_events_and_changes_of_gait_come_with_their_time():
    telemetry = []
    gaits = ("trot", "trot", "walk", "walk", "trot", "trot")
    modes = (Mode.STAND, Mode.WALK, Mode.WALK, Mode.STAND, Mode.STAND, Mode.WALK)
    records = make_run(len(gaits)).telemetry
    for k, (record, gait, mode) in enumerate(zip(records, gaits, modes, strict=True)):
        motion = replace(record.motion, gait=gait)
        events = ("mode stand -> walk",) if k == 1 else ()
        telemetry.append(replace(record, motion=motion, mode=mode, events=events))
    # A gait that is chosen while standing is no change while walking.
    assert happenings(telemetry) == [
        (records[1].time, "mode stand -> walk"),
        (records[2].time, "gait trot -> walk"),
    ]
