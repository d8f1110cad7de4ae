"""What exists: the robot, the station, the liquids, and the events that happen to them."""
