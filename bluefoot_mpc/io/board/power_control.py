"""The host's side of the supply switch: on takes two steps, off is repeated until it is seen.

Pure bookkeeping: it says which messages to send; the driver sends them.
"""

from __future__ import annotations

import enum
import math

from bluefoot_mpc.io.board.config import BoardConfig
from bluefoot_mpc.io.board.messages import POWER_MAGIC, WORD, CutReason, Kind, Power, Refusal

Order = tuple[Kind, bytes]
"""A message to send: its type and its payload."""

CUT_ORDERS: tuple[Order, ...] = ((Kind.POWER_CUT, b""),) * 3
"""A cut goes out three times at once: one of them will not be damaged."""

_REFUSALS = {
    Refusal.MAGIC: "the request for a code was not understood: update the board's firmware",
    Refusal.NO_CODE: "no code was asked for: try again",
    Refusal.LATE: "the code came too late: check the load on this computer, then try again",
    Refusal.CODE: "the code was wrong: check the cable, then try again",
    Refusal.HEARTBEAT: "no heartbeat from this computer: the control program must run",
    Refusal.VOLTAGE: "the battery is too low: charge it",
}
_FINAL = (Refusal.MAGIC, Refusal.VOLTAGE)
_NO_ANSWER = "the board does not answer the request for power: check its cable and supply"
_CUTS = {
    CutReason.HEARTBEAT: "the board cut the servos' power: it heard no heartbeat for 0.5 s",
    CutReason.VOLTAGE: "the board cut the servos' power: the battery is too low",
    CutReason.BUTTON: "the servos' power was cut by the button on the robot",
}


class Phase(enum.Enum):
    """How far switching on has come."""

    OFF = enum.auto()
    ASKED = enum.auto()
    SENT = enum.auto()
    ON = enum.auto()


class PowerControl:
    """What is wanted, what the board says, and what is to be sent.

    Attributes:
        phase: how far switching on has come.
        is_cut: True from a cut until power is wanted again; no heartbeats are sent meanwhile.
        refused: why power did not come on, or went; empty where it is as wanted.
        report: the board's newest message.
    """

    def __init__(self, config: BoardConfig) -> None:
        self._config = config
        self.phase = Phase.OFF
        self.is_cut = False
        self.refused = self._why = ""
        self.report: Power | None = None
        self.heard = -math.inf
        self._cut_at = -math.inf
        self._due = -math.inf
        self._tries = 0

    def want_on(self, now: float) -> list[Order]:
        """Begin to switch on; gives what to send at once."""
        if self.phase is Phase.ON and not self.is_cut:
            return []
        self.is_cut = False
        self.refused = self._why = ""
        self.phase = Phase.ASKED
        self._tries = 0
        return self._ask(now)

    def cut(self, now: float) -> tuple[Order, ...]:
        """Switch off; gives what to send at once."""
        self.is_cut = True
        self.phase = Phase.OFF
        self._cut_at = now
        return CUT_ORDERS

    def _ask(self, now: float) -> list[Order]:
        self._tries += 1
        self._due = now + self._config.answer
        self.phase = Phase.ASKED
        return [(Kind.GET_CODE, WORD.pack(POWER_MAGIC))]

    def orders(self, now: float) -> list[Order]:
        """What is to be sent now: repeated cuts, repeated requests."""
        report = self.report
        if self.is_cut:
            # As long as the board has not said that it is off, it may not have heard.
            is_off = report is not None and not report.on and self.heard > self._cut_at
            return [] if is_off else [CUT_ORDERS[0]]
        if self.phase in (Phase.ASKED, Phase.SENT) and now >= self._due:
            if self._tries >= self._config.answer_tries:
                self.phase = Phase.OFF
                self.refused = self._why or _NO_ANSWER
                return []
            return self._ask(now)
        return []

    def on_code(self, code: int) -> list[Order]:
        """The board has sent a code; gives what to send at once."""
        if self.phase is not Phase.ASKED or self.is_cut:
            return []
        self.phase = Phase.SENT
        return [(Kind.POWER_ON, WORD.pack(~code & 0xFFFFFFFF))]

    def on_refusal(self, refusal: Refusal) -> None:
        """The board does not switch on; what may be otherwise in a moment is tried again."""
        if self.phase in (Phase.ASKED, Phase.SENT):
            self._why = f"no power for the servos: {_REFUSALS[refusal]}"
            if refusal in _FINAL:
                self.phase = Phase.OFF
                self.refused = self._why

    def on_report(self, report: Power, now: float) -> None:
        """The board has told its state."""
        self.report, self.heard = report, now
        if report.on and self.phase in (Phase.ASKED, Phase.SENT):
            self.phase = Phase.ON
        elif not report.on and self.phase is Phase.ON:
            self.phase = Phase.OFF
            self.refused = _CUTS.get(report.cut, "the board has switched the servos' power off by itself")

    @property
    def power_on(self) -> bool:
        """True while there is voltage behind the switch, as far as the board has said."""
        return self.report is not None and self.report.live

    def faults(self, now: float) -> tuple[str, ...]:
        """What is wrong, one sentence each."""
        found = (self.refused,) if self.refused else ()
        report = self.report
        waited = now - self._cut_at > self._config.live_after_cut
        if report is not None and report.live and (not report.on or self.is_cut) and waited:
            return (*found, "the servos still have power after it was cut: pull the battery")
        return found
