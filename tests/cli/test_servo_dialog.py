"""The table of findings that the commands for servos show."""

import io

from rich.console import Console

from bluefoot_mpc.cli.servo_dialog import findings_table
from bluefoot_mpc.io.findings import Finding, Severity


def shown(findings):
    page = io.StringIO()
    Console(file=page, width=200).print(findings_table(findings, "Findings"))
    return page.getvalue()


def finding(number, text):
    return Finding(part=f"servo {number} (knee)", text=text, severity=Severity.REFUSAL)


def test_what_two_checks_found_is_shown_once():
    page = shown([finding(1, "not verified"), Finding(part="robot", text="here"), finding(1, "not verified")])
    assert "servo 1 (knee)" in page
    assert page.count("not verified") == 1


def test_servos_with_the_same_finding_share_a_line():
    assert "servos 1-3, 7 " in shown([finding(number, "hot") for number in (1, 2, 3, 7)])
