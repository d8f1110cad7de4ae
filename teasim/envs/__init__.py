"""The station as Gymnasium environments: joint targets at 10 Hz, and whole sub-tasks."""
