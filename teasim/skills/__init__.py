"""How it is done: inverse kinematics, one skill per sub-task, and demonstrators with style."""
