"""Which servos answer, and what they say about themselves: reads only, writes nothing."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.io.calibration import joint_of_id
from bluefoot_mpc.io.commissioning.ports import STANDARD_BAUDS, ServoPorts
from bluefoot_mpc.io.dynamixel.bus import ServoBus
from bluefoot_mpc.io.dynamixel.codec import LAST_ID, error_words
from bluefoot_mpc.io.dynamixel.errors import CorruptReplyError, NoReplyError, ServoError
from bluefoot_mpc.io.dynamixel.table import AX12A, RAM_START
from bluefoot_mpc.io.dynamixel.units import load_from_register
from bluefoot_mpc.io.findings import Finding, Severity
from bluefoot_mpc.io.link import LinkError

_EEPROM_END = AX12A["shutdown"].end
_LOOKS = 3
"""Times that a servo is read: two servos with one ID answer alike to a ping, hardly to this."""


@dataclass(frozen=True, kw_only=True, slots=True)
class ServoFacts:
    """What one servo says about itself.

    Attributes:
        id: as asked.
        port: where it answered.
        registers: value of every register of the control table by name, in its own units.
        error: error bits of its last reply.
    """

    id: int
    port: str
    registers: dict[str, int]
    error: int = 0

    def __getitem__(self, name: str) -> int:
        """A register's value."""
        return self.registers[name]

    @property
    def joint(self) -> str:
        """Name of the joint that the ID belongs to."""
        return joint_of_id(self.id)

    @property
    def part(self) -> str:
        """Name for messages."""
        return f"servo {self.id} ({self.joint})"

    @property
    def voltage(self) -> float:
        """V."""
        return 0.1 * self.registers["present_voltage"]

    @property
    def load(self) -> float:
        """Share of full duty, counter-clockwise positive."""
        return load_from_register(self.registers["present_load"])

    @property
    def errors(self) -> str:
        """Lasting errors in words; empty without."""
        return error_words(self.error) if self.error else ""

    @property
    def limits(self) -> tuple[int, int]:
        """Angle limits, counts."""
        return self.registers["cw_angle_limit"], self.registers["ccw_angle_limit"]


@dataclass(frozen=True, kw_only=True, slots=True)
class Survey:
    """What was found on the given IDs.

    Attributes:
        servos: those that answer, by ID.
        garbled: what was wrong with the answer of those whose replies come broken, by ID.
        missing: IDs that nobody answers.
        twice: ports of IDs that answer on more than one port.
    """

    servos: dict[int, ServoFacts]
    garbled: dict[int, str] = field(default_factory=dict)
    missing: tuple[int, ...] = ()
    twice: dict[int, tuple[str, ...]] = field(default_factory=dict)


def parse_ids(text: str) -> tuple[int, ...]:
    """IDs from ``1-16`` or ``1,4,7-9``, in order.

    Raises:
        ConfigurationError: it has another form, or names an ID that no servo can have.
    """
    ids: set[int] = set()
    for part in text.split(","):
        first, sign, last = part.strip().partition("-")
        with contextlib.suppress(ValueError):
            low, high = int(first), int(last if sign else first)
            if 0 <= low <= high <= LAST_ID:
                ids.update(range(low, high + 1))
                continue
        raise ConfigurationError(f"--ids = '{text}' is not of the form 1-16 or 1,4,7-9 with IDs 0..{LAST_ID}")
    return tuple(sorted(ids))


def survey(ports: ServoPorts, ids: Sequence[int], progress: Callable[[], None] = lambda: None) -> Survey:
    """Ask every ID on every port; `progress` is called after each ID.

    Raises:
        LinkLostError: a port is gone.
    """
    servos: dict[int, ServoFacts] = {}
    garbled: dict[int, str] = {}
    twice: dict[int, tuple[str, ...]] = {}
    for servo in ids:
        where: list[str] = []
        for bus in ports.buses:
            try:
                facts = look_at(bus, servo)
            except NoReplyError:
                continue
            except ServoError as error:
                garbled[servo] = str(error)
                continue
            where.append(bus.name)
            servos.setdefault(servo, facts)
        if len(where) > 1:
            twice[servo] = tuple(where)
        progress()
    missing = tuple(servo for servo in ids if servo not in servos and servo not in garbled)
    return Survey(servos=servos, garbled=garbled, missing=missing, twice=twice)


def look_at(bus: ServoBus, servo: int) -> ServoFacts:
    """Everything that a servo says about itself.

    Raises:
        NoReplyError: nobody has the ID.
        CorruptReplyError: replies come broken, more than a disturbed line would explain.
        ServoFaultError: it refuses to be read.
    """
    counts = bus.statistics.of(servo)
    before = counts.corrupt
    bus.ping(servo)
    table = b""
    for _ in range(_LOOKS):
        try:
            low = bus.read_block(servo, 0, _EEPROM_END)
            high = bus.read_block(servo, RAM_START, AX12A.size - RAM_START)
        except NoReplyError:
            raise CorruptReplyError(
                servo, bus.name, "it answers pings and no reads (status return level 0?)"
            ) from None
        table = low + bytes(RAM_START - _EEPROM_END) + high
    if counts.corrupt - before > _LOOKS:
        raise CorruptReplyError(
            servo, bus.name, f"{counts.corrupt - before} broken replies in a row of reads"
        )
    values = {register.name: register.decode(table, 0) for register in AX12A}
    return ServoFacts(id=servo, port=bus.name, registers=values, error=int(bus.errors.get(servo, 0)))


def survey_findings(found: Survey) -> tuple[Finding, ...]:
    """What is wrong with the answers themselves: missing, garbled, answering twice, of another model."""
    out = []
    for servo in found.missing:
        mend = "Check its cable and supply; a new servo has ID 1: bluefoot servo setup --new-id"
        out.append(_refusal(servo, "no reply", mend))
    for servo in found.garbled:
        mend = (
            "Unplug servos one by one until it is clean; give the second one another ID: bluefoot servo setup"
        )
        out.append(
            _refusal(servo, "replies come broken: two servos share this ID, or the cable is bad", mend)
        )
    for servo, where in found.twice.items():
        mend = "Give one of them another ID: bluefoot servo setup"
        out.append(_refusal(servo, f"answers on {' and '.join(where)}", mend))
    for facts in found.servos.values():
        if facts["model_number"] != AX12A.model_number:
            text = f"model {facts['model_number']} instead of {AX12A.model_number} ({AX12A.model})"
            out.append(_refusal(facts.id, text, "Fit an AX-12A, or take it off the bus"))
    return tuple(out)


def find_bauds(
    ports: ServoPorts, ids: Sequence[int], progress: Callable[[], None] = lambda: None
) -> dict[int, tuple[int, ...]]:
    """IDs that answer at each standard rate; the ports go back to their own rate afterwards."""
    home = ports.baud
    found: dict[int, tuple[int, ...]] = {}
    try:
        for baud in STANDARD_BAUDS:
            progress()
            with contextlib.suppress(LinkError):  # a rate that the adapter does not have
                ports.change_baud(baud)
                heard = tuple(_heard(ports, ids))
                if heard:
                    found[baud] = heard
    finally:
        ports.change_baud(home)
    return found


def _heard(ports: ServoPorts, ids: Sequence[int]) -> Iterator[int]:
    """IDs that answer a ping at the present rate."""
    for servo in ids:
        for bus in ports.buses:
            with contextlib.suppress(ServoError):
                bus.ping(servo, tries=1)
                yield servo
                break


def _refusal(servo: int, text: str, mend: str) -> Finding:
    part = f"servo {servo} ({joint_of_id(servo)})"
    return Finding(part=part, text=text, mend=mend, severity=Severity.REFUSAL)
