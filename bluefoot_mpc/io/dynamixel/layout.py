"""Which servo drives which joint, and on which port it hangs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.io.dynamixel.codec import LAST_ID
from bluefoot_mpc.types import JOINTS, N_JOINTS


@dataclass(frozen=True, kw_only=True, slots=True)
class ServoLayout:
    """IDs and ports of the sixteen joints, in house order.

    Attributes:
        ids: servo IDs, 4·leg + joint + 1 as the robot is built.
        ports: for each joint the index of its port in the list of buses.
    """

    ids: tuple[int, ...] = tuple(range(1, N_JOINTS + 1))
    ports: tuple[int, ...] = (0,) * N_JOINTS

    def __post_init__(self) -> None:
        if len(self.ids) != N_JOINTS or len(self.ports) != N_JOINTS:
            raise ConfigurationError(
                f"layout: {len(self.ids)} IDs and {len(self.ports)} ports for {N_JOINTS} joints"
            )
        wrong = [servo for servo in self.ids if not 0 <= servo <= LAST_ID]
        if wrong or min(self.ports) < 0:
            raise ConfigurationError(
                f"layout: IDs {wrong or self.ids} and ports {self.ports} must lie in "
                f"0..{LAST_ID} and from 0 on"
            )
        places = list(zip(self.ports, self.ids, strict=True))
        twice = sorted({servo for port, servo in places if places.count((port, servo)) > 1})
        if twice:
            raise ConfigurationError(f"layout: IDs {twice} are given to more than one joint of a port")

    @property
    def n_ports(self) -> int:
        """How many ports the layout needs."""
        return max(self.ports) + 1

    def joints(self, port: int) -> tuple[int, ...]:
        """Joints (0..15) that hang on a port."""
        return tuple(joint for joint in range(N_JOINTS) if self.ports[joint] == port)

    def part(self, joint: int) -> str:
        """Name of a servo for messages, e.g. ``"servo 7 (FR_knee)"``."""
        return f"servo {self.ids[joint]} ({JOINTS[joint]})"


def spread(n_ports: int, ids: Sequence[int] | None = None) -> ServoLayout:
    """The usual layouts: all joints on one port, a port for each pair of legs, or one for each leg.

    Args:
        n_ports: 1, 2 (front, rear) or 4 (FL, FR, RL, RR).
        ids: (16,) servo IDs where they are not those the robot is built with.

    Raises:
        ConfigurationError: another number of ports.
    """
    if n_ports not in {1, 2, 4}:
        raise ConfigurationError(
            f"{n_ports} ports: joints are spread over 1, 2 (front, rear) or 4 (one a leg)"
        )
    ports = tuple(joint * n_ports // N_JOINTS for joint in range(N_JOINTS))
    return ServoLayout(ids=tuple(ids), ports=ports) if ids is not None else ServoLayout(ports=ports)
