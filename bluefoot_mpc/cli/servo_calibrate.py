"""``bluefoot servo calibrate``."""

from __future__ import annotations

import dataclasses
import sys
from collections.abc import Sequence
from typing import Any

from rich.table import Table

from bluefoot_mpc.cli.outcome import FAILED, OK, Outcome
from bluefoot_mpc.cli.servo import open_ports
from bluefoot_mpc.cli.servo_arguments import CalibrateCommand
from bluefoot_mpc.cli.servo_dialog import Answers, bar, findings_data, findings_table
from bluefoot_mpc.exceptions import ConfigurationError, DeviceError, UnknownNameError
from bluefoot_mpc.io import calibration as cal
from bluefoot_mpc.io.commissioning.calibrate import check_joints, posed, read_counts, untouched, with_checks
from bluefoot_mpc.io.commissioning.checks import silence
from bluefoot_mpc.io.commissioning.ports import ServoPorts, torque_off
from bluefoot_mpc.io.commissioning.pose import Pose, drawing, joint_table, parse_pose, positive_direction
from bluefoot_mpc.io.commissioning.survey import Survey, survey, survey_findings
from bluefoot_mpc.model.legs.geometry import LegGeometry
from bluefoot_mpc.model.parameters import RobotParameters, load_parameters
from bluefoot_mpc.types import JOINTS, N_JOINTS


def calibrate(command: CalibrateCommand) -> Outcome:
    """Find offsets and signs."""
    parameters = load_parameters(command.model)
    geometry = LegGeometry.from_parameters(parameters)
    pose = parse_pose(command.pose, geometry)
    joints = _chosen(command.joints)
    if command.draw:
        return _drawn(geometry, pose)
    base = _base(command, parameters)
    dialog = Answers(yes=command.yes)
    with open_ports(command) as ports:
        found = _found(ports, base.ids)
        still = torque_off(ports, base.ids)
        if still:
            raise DeviceError(f"servo {still[0]} keeps its torque: cut the servos' power. Nothing was stored")
        dialog.say(drawing(geometry, pose))
        dialog.wait("Torque is off. Put the robot on a stand and pose its legs as drawn, and hold them there")
        made = posed(base, found, read_counts(ports, base.ids), pose, _signs(base))
        made = _keep_others(base, made, joints)
        if command.yes:
            made = _as_before(base, made)
        else:
            words = {joint: positive_direction(geometry, pose, joint) for joint in joints}
            made = with_checks(made, check_joints(ports, made, words, dialog), pose)
    cal.save_calibration(made, command.out)
    return _outcome(command, made, parameters.name)


def _outcome(command: CalibrateCommand, made: cal.Calibration, model: str) -> Outcome:
    findings = [f for f in cal.findings(made, model) if f.mend]
    open_joints = untouched(made)
    table = Table(title=f"Calibration of {made.model}", title_justify="left")
    for heading in ("joint", "ID", "sign", "offset", "degrees", "verified"):
        table.add_column(heading, justify="left" if heading == "joint" else "right")
    for joint in made.joints:
        table.add_row(
            joint.name, str(joint.id), f"{joint.sign:+d}", str(joint.offset),
            f"{joint.offset * 300.0 / 1023.0:+.1f}", "yes" if joint.verified else "no",
        )  # fmt: skip
    page: list[Any] = [table, f"wrote {command.out}"]
    if findings:
        page.insert(1, findings_table(findings, "What is left to do"))
    data = {
        "file": command.out, "signs": [j.sign for j in made.joints],
        "offsets": [j.offset for j in made.joints],
        "unverified": open_joints, "findings": findings_data(findings), "success": not open_joints,
    }  # fmt: skip
    return Outcome(status=FAILED if open_joints else OK, data=data, page=tuple(page))


def _base(command: CalibrateCommand, parameters: RobotParameters) -> cal.Calibration:
    """What is there already, or a nominal calibration that nobody has verified."""
    if command.out.is_file():
        base = cal.load_calibration(command.out)
        if base.model != parameters.name:
            raise ConfigurationError(
                f"{command.out} belongs to the robot '{base.model}', not '{parameters.name}': "
                "name another file with --out, or the right robot with --model"
            )
        return base
    base = cal.Calibration.nominal(parameters)
    return dataclasses.replace(
        base, joints=tuple(dataclasses.replace(joint, verified=False) for joint in base.joints)
    )


def _found(ports: ServoPorts, ids: Sequence[int]) -> Survey:
    """All servos of the calibration.

    Raises:
        DeviceError: one is missing, garbled or of another model.
    """
    with bar("look", len(ids)) as progress:
        found = survey(ports, ids, progress)
    findings = silence(ports, ids, found) or list(survey_findings(found))
    if findings:
        raise DeviceError("nothing was stored:\n  " + "\n  ".join(map(str, findings)))
    return found


def _keep_others(base: cal.Calibration, made: cal.Calibration, joints: Sequence[int]) -> cal.Calibration:
    """Joints that were not asked for stay as they were."""
    kept = tuple(
        made.joints[index] if index in joints else dataclasses.replace(
            base.joints[index], servo_model=made.joints[index].servo_model,
            firmware=made.joints[index].firmware, port=made.joints[index].port,
        )
        for index in range(N_JOINTS)
    )  # fmt: skip
    return dataclasses.replace(made, joints=kept).sealed()


def _as_before(base: cal.Calibration, made: cal.Calibration) -> cal.Calibration:
    """Signs that were verified before count as verified: only offsets are new."""
    for index, joint in enumerate(base.joints):
        made = made.with_joint(index, verified=joint.verified)
    return made.sealed()


def _signs(base: cal.Calibration) -> list[int]:
    return [joint.sign for joint in base.joints]


def _chosen(text: str) -> tuple[int, ...]:
    """Indices of the joints named, all without a name."""
    names = [name.strip() for name in text.split(",") if name.strip()]
    for name in names:
        if name not in JOINTS:
            raise UnknownNameError("joint", name, JOINTS)
    return tuple(JOINTS.index(name) for name in names) if names else tuple(range(N_JOINTS))


def _drawn(geometry: LegGeometry, pose: Pose) -> Outcome:
    """The pose and the directions, without a robot."""
    directions = joint_table(geometry, pose)
    table = Table(title="Greater angles", title_justify="left")
    table.add_column("joint")
    table.add_column("turns so that")
    for name, text in directions:
        table.add_row(name, text)
    text = drawing(geometry, pose)
    sys.stderr.flush()
    return Outcome(data={"drawing": text, "directions": dict(directions)}, page=(text, table))
