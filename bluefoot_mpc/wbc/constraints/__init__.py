"""What the plan must not break: dynamics, contacts, friction, torque and joint limits."""
