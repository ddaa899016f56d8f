"""Commands to a running robot from a script, over its radio link.

    bluefoot run remote --station udp:127.0.0.1:14550 --duration 60    # in one terminal
    python scripts/commands.py                                         # in another

The same steps inside the robot's own program, without a link:
bluefoot run remote --set 'scenario.script="walk 5 forward=0.06; turn 4 left=15; pose 2 pitch=5; sit 2"'
"""

import sys

from bluefoot_mpc.exceptions import BlueFootError
from bluefoot_mpc.io.station.client import RemoteRobot


def main() -> int:
    address = sys.argv[1] if len(sys.argv) > 1 else "udpin:127.0.0.1:14550"
    try:
        with RemoteRobot(address) as robot:
            robot.walk(5.0, forward=0.06)
            robot.turn(4.0, left=15.0)
            robot.walk(4.0, forward=0.04, left=0.02, gait="walk")
            robot.pose(2.0, roll=5.0, pitch=-5.0)
            robot.sit(3.0)
            x, y, _ = robot.picture().position
            print(f"it sits {1e3 * x:.0f} mm ahead and {1e3 * y:.0f} mm to the left of where it began")
    except BlueFootError as error:
        print(f"error: {error}", file=sys.stderr)
        return error.exit_status
    return 0


if __name__ == "__main__":
    sys.exit(main())
