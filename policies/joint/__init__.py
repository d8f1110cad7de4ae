"""The joint level: where the joints go next, ten times a second."""
