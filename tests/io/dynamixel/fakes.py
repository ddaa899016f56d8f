"""A line of servos with nothing but memory, whose replies a test may change on their way."""

import math

from bluefoot_mpc.io.clock import VirtualClock
from bluefoot_mpc.io.dynamixel.bus import BusConfig, ServoBus
from bluefoot_mpc.io.dynamixel.codec import Instruction, InstructionPacket, InstructionParser, status_packet
from bluefoot_mpc.io.dynamixel.table import AX12A
from bluefoot_mpc.io.link import LinkError, LinkLostError


def registers(servo, position=512):
    table = bytearray(50)
    for register in AX12A:
        if register.default is not None:
            table[register.address : register.end] = register.default.to_bytes(register.size, "little")
    table[3], table[5] = servo, 0
    table[30:32] = table[36:38] = position.to_bytes(2, "little")
    table[34:36] = b"\xff\x03"
    table[42], table[43] = 118, 31
    return table


class FakeLine:
    """A link and its servos in one: bytes take 10 µs, replies come whole.

    Attributes:
        tables: registers by ID; a servo that is taken out is unplugged.
        change: called with a servo's reply, gives what arrives instead: (delay, bytes) each.
        sent: every packet that the host has sent.
        errors: error byte of a servo's replies, by ID.
    """

    name, baud = "fake line", 1_000_000

    def __init__(self, clock=None, ids=range(1, 17)):
        self.clock = clock or VirtualClock()
        self.tables = {servo: registers(servo, 500 + servo) for servo in ids}
        self.change = lambda servo, reply: [(0.0, reply)]
        self.sent = []
        self.errors = {}
        self.is_gone = False
        self._arriving = []
        self._waiting = b""
        self._free_at = 0.0
        self._parser = InstructionParser()

    def write(self, data):
        self._check()
        self._free_at = max(self.clock.now(), self._free_at) + 1e-5 * len(data)
        for packet in self._parser.feed(data):
            assert isinstance(packet, InstructionPacket), packet
            self.sent.append(packet)
            reply = self._execute(packet)
            if reply is not None:
                for delay, piece in self.change(packet.id, reply):
                    self.inject(piece, self._free_at + 1e-5 * len(piece) + delay)

    def inject(self, data, at):
        """Let bytes arrive, the last of them at a time."""
        self._arriving.append((at, data))
        self._arriving.sort(key=lambda item: item[0])

    def read(self, count, deadline):
        self._check()
        due = self._arriving[0][0] if self._arriving else math.inf
        if not self._waiting and self.clock.now() < min(due, deadline):
            self.clock.sleep_until(min(due, deadline))
        while self._arriving and self._arriving[0][0] <= self.clock.now():
            self._waiting += self._arriving.pop(0)[1]
        data, self._waiting = self._waiting[:count], self._waiting[count:]
        return data

    def discard(self):
        self.read(1 << 16, 0.0)

    def reopen(self):
        if self.is_gone:
            raise LinkError("still gone")

    def close(self):
        pass

    def _check(self):
        if self.is_gone:
            raise LinkLostError(f"{self.name} is gone")

    def _execute(self, packet):
        code, parameters = packet.instruction, packet.parameters
        if code == Instruction.SYNC_WRITE:
            size = parameters[1] + 1
            for at in range(2, len(parameters), size):
                self._store(parameters[at], parameters[0], parameters[at + 1 : at + size])
            return None
        if packet.id == 254:
            for servo in self.tables if code == Instruction.WRITE else ():
                self._store(servo, parameters[0], parameters[1:])
            return None
        if packet.id not in self.tables:
            return None
        error, table = self.errors.get(packet.id, 0), self.tables[packet.id]
        if code == Instruction.READ:
            return status_packet(packet.id, error, bytes(table[parameters[0] : sum(parameters)]))
        if code == Instruction.WRITE:
            self._store(packet.id, parameters[0], parameters[1:])
        return status_packet(packet.id, error)

    def _store(self, servo, address, data):
        if servo in self.tables:
            self.tables[servo][address : address + len(data)] = data
            if address <= 31 and address + len(data) > 30:
                self.tables[servo][24] = 1  # as an AX-12A is known to do


def fake_bus(**options):
    line = FakeLine()
    return ServoBus(line, line.clock, BusConfig(**options)), line


def code_count(line, code):
    return sum(packet.instruction == code for packet in line.sent)
