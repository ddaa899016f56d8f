"""Faults: what is wrong, how the robot answers, and what to do about it."""

from __future__ import annotations

import enum
import logging
from collections.abc import Iterable
from dataclasses import dataclass

from bluefoot_mpc.types import SafetyLevel, SafetyRequest

log = logging.getLogger(__name__)


class Response(enum.IntEnum):
    """How the robot answers to a fault; higher is more urgent."""

    WARN = 0
    HOLD = 1
    SIT = 2
    STOP = 3
    EMERGENCY = 4


@dataclass(frozen=True, kw_only=True, slots=True)
class Fault:
    """One thing that is wrong.

    Attributes:
        key: tells faults apart: each is told once, whatever its text says later.
        response: how the robot answers.
        text: cause, evidence and way out.
        latched: holds until the robot is reset or armed anew; else only as long as it lasts.
    """

    key: str
    response: Response
    text: str
    latched: bool = True


class FaultBook:
    """Keeps what is wrong, and tells each thing once.

    Attributes:
        request: what all faults together ask of the controller.
        warnings: what people should know though the robot goes on.
    """

    def __init__(self) -> None:
        self.clear()

    def clear(self) -> None:
        """Forget everything."""
        self.request = SafetyRequest()
        self.warnings: tuple[str, ...] = ()
        self._latched: dict[str, Fault] = {}
        self._passing: dict[str, Fault] = {}

    def note(self, fault: Fault) -> None:
        """Latch one fault; passing ones stay as they are."""
        self._keep(fault)
        self._publish()

    def take(self, faults: Iterable[Fault]) -> None:
        """Every fault that was found on this tick: passing ones that are not among them are over."""
        passing: dict[str, Fault] = {}
        for fault in faults:
            if fault.latched:
                self._keep(fault)
                continue
            if fault.key not in self._passing:
                log.warning("safety: %s", fault.text)
            passing[fault.key] = fault
        if passing or self._passing:
            self._passing = passing
            self._publish()

    def _keep(self, fault: Fault) -> None:
        if fault.key not in self._latched:
            log.warning("safety: %s", fault.text)
            self._latched[fault.key] = fault
            self._publish()

    def _publish(self) -> None:
        faults = (*self._latched.values(), *self._passing.values())
        serious = [fault for fault in faults if fault.response > Response.WARN]
        worst = max((fault.response for fault in serious), default=Response.WARN)
        self.warnings = tuple(fault.text for fault in faults if fault.response is Response.WARN)
        self.request = SafetyRequest(
            level=SafetyLevel(min(worst, Response.STOP)), reasons=tuple(fault.text for fault in serious)
        )
