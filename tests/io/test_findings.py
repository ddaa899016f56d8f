"""What a person reads when a robot is not armed."""

from bluefoot_mpc.io.findings import Finding, NotArmedError, Severity


def refusal(part, text="no reply", mend="Check its cable"):
    return Finding(part=part, text=text, mend=mend, severity=Severity.REFUSAL)


def test_only_refusals_are_named_with_their_mend():
    error = NotArmedError([refusal("servo 7 (FR_knee)"), Finding(part="battery", text="12.0 V")])
    assert str(error) == "not armed, no torque is on:\n  servo 7 (FR_knee): no reply. Check its cable"
    assert len(error.findings) == 2
    assert error.exit_status == 3


def test_parts_with_the_same_trouble_share_a_line():
    text = str(NotArmedError([refusal(f"servo {i}") for i in range(1, 17)] + [refusal("port", "slow")]))
    assert text.splitlines()[1:] == [
        "  servo 1, servo 2 … servo 16, 16 in all: no reply. Check its cable",
        "  port: slow. Check its cable",
    ]
