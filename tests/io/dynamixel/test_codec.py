import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bluefoot_mpc.io.dynamixel.codec import (
    ErrorBit,
    Instruction,
    InstructionPacket,
    InstructionParser,
    Problem,
    ProblemKind,
    StatusPacket,
    StatusParser,
    error_words,
    instruction_packet,
    ping_packet,
    read_packet,
    status_packet,
    sync_write_packet,
    write_packet,
)


def packets(found):
    return [item for item in found if not isinstance(item, Problem)]


def garbage(found):
    return b"".join(
        item.data for item in found if isinstance(item, Problem) and item.kind is ProblemKind.GARBAGE
    )


def test_packets_of_the_manual():
    # ROBOTIS e-manual, Protocol 1.0: read the temperature of servo 1, its answer 32 °C; ping; action.
    assert read_packet(1, 43, 1) == bytes.fromhex("ffff0104022b01cc")
    assert status_packet(1, 0, b"\x20") == bytes.fromhex("ffff01030020db")
    assert ping_packet(1) == bytes.fromhex("ffff010201fb")
    assert instruction_packet(254, Instruction.ACTION) == bytes.fromhex("fffffe0205fa")


def test_sync_write_of_the_manual():
    # ROBOTIS e-manual, Protocol 1.0, SYNC WRITE: goal and speed of servos 0 to 3.
    goals = {0: "10005001", 1: "20026003", 2: "30007001", 3: "20028003"}
    packet = sync_write_packet(30, {servo: bytes.fromhex(data) for servo, data in goals.items()})
    assert packet == bytes.fromhex("fffffe18831e04001000500101200260030230007001032002800312")


def test_sizes_of_sixteen_servos():
    ids = range(1, 17)
    assert len(sync_write_packet(30, {servo: bytes(4) for servo in ids})) == 88
    assert len(sync_write_packet(30, {servo: bytes(6) for servo in ids})) == 120


def test_impossible_packets_are_refused():
    with pytest.raises(ValueError, match="255 must lie"):
        ping_packet(255)
    with pytest.raises(ValueError, match="do not fit"):
        instruction_packet(1, Instruction.WRITE, bytes(138))
    with pytest.raises(ValueError, match="254 must lie"):
        status_packet(254)
    with pytest.raises(ValueError, match="same number"):
        sync_write_packet(30, {1: b"ab", 2: b"a"})


def test_error_bits_in_words():
    assert error_words(ErrorBit.OVERHEATING | ErrorBit.OVERLOAD) == (
        "it is too hot; its load is more than it can hold"
    )
    assert error_words(0) == "no error"


bodies = st.binary(max_size=50)


@given(st.integers(0, 253), st.integers(0, 255), bodies, st.data())
def test_a_packet_in_any_pieces(servo, error, parameters, data):
    stream = status_packet(servo, error, parameters)
    parser = StatusParser()
    found = []
    while stream:
        cut = data.draw(st.integers(1, len(stream)))
        found += parser.feed(stream[:cut])
        stream = stream[cut:]
    assert found == [StatusPacket(servo, error, parameters)]
    assert parser.pending == 0


@given(
    st.lists(
        st.one_of(
            st.tuples(
                st.just(True), st.builds(status_packet, st.integers(0, 253), st.integers(0, 127), bodies)
            ),
            # Without FF no false header in the garbage can take a good packet's beginning for its own.
            st.tuples(
                st.just(False), st.binary(max_size=20).map(lambda data: data.replace(b"\xff", b"\x00"))
            ),
        ),
        max_size=6,
    )
)
def test_good_packets_survive_garbage_and_no_byte_is_lost(parts):
    parser = StatusParser()
    found = parser.feed(b"".join(data for _, data in parts)) + parser.flush()
    again = [status_packet(item.id, item.error, item.parameters) for item in packets(found)]
    assert again == [data for good, data in parts if good]
    assert garbage(found) == b"".join(data for good, data in parts if not good)


@pytest.mark.parametrize(
    "before",
    [
        b"\xff",
        b"\xff\xff",
        b"\xff\xff\xff\xff\xff",
        b"\xff\xff\x07",
        b"\xff\xff\x07\x00",
        b"\xff\xff\x07\x01",
        b"\xff\xff\x07\xff",
        b"\xff\xff\xfe\x04",
        b"\xff\xff\x07\x03\x00\x20\x00",
        b"\xff\xff\x07\x04\x00",
        b"\x00\xff\x01\xff\xff\x09\x08\x01",
    ],
)
def test_a_false_beginning_does_not_cost_the_packet_behind_it(before):
    good = status_packet(7, 0, b"\x34\x02")
    parser = StatusParser()
    found = parser.feed(before + good + good) + parser.flush()
    assert packets(found)[-1] == StatusPacket(7, 0, b"\x34\x02")
    assert len(packets(found)) == 2


@pytest.mark.parametrize("off_by", range(1, 256))
def test_no_wrong_checksum_is_taken(off_by):
    bad = bytearray(status_packet(7, 0, b"\x34\x02"))
    bad[-1] = (bad[-1] + off_by) & 0xFF
    assert not packets(StatusParser().feed(bytes(bad)))


def test_problems_say_what_is_wrong():
    bad = bytearray(status_packet(7, 0, b"\x34\x02"))
    bad[-1] ^= 1
    found = StatusParser().feed(bytes(bad) + b"\xff\xff\x09\x00")
    kinds = [(item.kind, item.id) for item in found]
    assert (ProblemKind.BAD_CHECKSUM, 7) in kinds
    assert (ProblemKind.BAD_LENGTH, 9) in kinds


@given(st.integers(0, 254), st.integers(0, 255), st.binary(max_size=137))
def test_instructions(servo, code, parameters):
    assert InstructionParser().feed(instruction_packet(servo, code, parameters)) == [
        InstructionPacket(servo, code, parameters)
    ]


def test_registered_write():
    assert write_packet(3, 30, b"\x00\x02", registered=True)[4] == Instruction.REG_WRITE


def random_stream(rng):
    """Up to 64 bytes: noise rich in headers, mostly with a packet inside, often a spoilt one."""
    noise = rng.randbytes(rng.randrange(65))
    if rng.random() < 0.5:
        noise = noise.translate(MANY_HEADERS)
    if rng.random() < 0.7:
        inside = bytearray(
            status_packet(rng.randrange(254), rng.randrange(128), rng.randbytes(rng.randrange(9)))
        )
        if rng.random() < 0.5:
            inside[rng.randrange(len(inside))] ^= 1 << rng.randrange(8)
        cut = rng.randrange(len(noise) + 1)
        noise = noise[:cut] + inside + noise[cut:]
    return noise[:64]


MANY_HEADERS = bytes(0xFF if value < 100 else value % 8 for value in range(256))


def fuzz(streams, seed):
    """Random streams in two pieces: no wrong checksum is taken, no byte is lost."""
    rng = random.Random(seed)
    accepted = 0
    for _ in range(streams):
        stream = random_stream(rng)
        parser = StatusParser()
        found = []
        cut = rng.randrange(len(stream) + 1)
        for piece in (stream[:cut], stream[cut:]):
            found += parser.feed(piece)
        found += parser.flush()
        rebuilt = b""
        for item in found:
            if isinstance(item, StatusPacket):
                accepted += 1
                rebuilt += status_packet(item.id, item.error, item.parameters)
            elif item.kind is ProblemKind.GARBAGE:
                rebuilt += item.data
        # Packets are built anew with a right checksum: equal bytes mean that each was right as it came.
        assert rebuilt == stream
    return accepted


def test_random_streams():
    assert fuzz(5000, seed=1) > 1000


@pytest.mark.slow
def test_a_million_random_streams():
    assert fuzz(1_000_000, seed=2) > 200_000


@settings(max_examples=200)
@given(st.binary(max_size=64), st.integers(0, 63))
def test_pieces_do_not_matter(stream, cut):
    whole, pieces = StatusParser(), StatusParser()
    at_once = whole.feed(stream) + whole.flush()
    in_two = pieces.feed(stream[:cut]) + pieces.feed(stream[cut:]) + pieces.flush()
    assert packets(at_once) == packets(in_two)
    assert garbage(at_once) == garbage(in_two)
