"""Finding the way: potential field, visual servoing, waypoints, and what keeps the robot off things."""
