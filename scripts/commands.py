"""Commands to a running robot from a script, over its radio link.

    bluefoot run remote --station udp:127.0.0.1:14550 --duration 60    # in one terminal
    python scripts/commands.py                                         # in another

The same steps inside the robot's own program, without a link:
bluefoot run remote --set 'scenario.script="walk 5 forward=0.06; turn 4 left=15; pose 2 pitch=5; sit 2"'

Waypoints, and wandering through what is free, around what stands in the way; both need a LIDAR:
python scripts/commands.py --guided
bluefoot run remote --world room --set 'scenario.script="goto 40 points=1,0.5/1.2,-0.4; wander 20; sit 2"'
"""

import sys

from bluefoot_mpc.exceptions import BlueFootError
from bluefoot_mpc.io.station.client import RemoteRobot


def driven(robot: RemoteRobot) -> None:
    """Told where to go, step by step."""
    robot.walk(5.0, forward=0.06)
    robot.turn(4.0, left=15.0)
    robot.walk(4.0, forward=0.04, left=0.02, gait="walk")
    robot.pose(2.0, roll=5.0, pitch=-5.0)


def guided(robot: RemoteRobot) -> None:
    """Finding its own way: to points that are m forward and m to the left of where it started."""
    arrived = robot.goto([(1.0, 0.5), (1.2, -0.4)], seconds=60.0, speed=0.12)
    print("it is there" if arrived else "it has not got there")
    robot.wander(15.0, speed=0.12)


def main() -> int:
    words = sys.argv[1:]
    task = guided if "--guided" in words else driven
    address = next((word for word in words if word != "--guided"), "udpin:127.0.0.1:14550")
    try:
        with RemoteRobot(address) as robot:
            task(robot)
            robot.sit(3.0)
            x, y, _ = robot.picture().position
            print(f"it sits {1e3 * x:.0f} mm ahead and {1e3 * y:.0f} mm to the left of where it began")
    except BlueFootError as error:
        print(f"error: {error}", file=sys.stderr)
        return error.exit_status
    return 0


if __name__ == "__main__":
    sys.exit(main())
