"""LeRobot data sets: what their versions have in common, a file per version, and verdicts."""
