"""Sources that show a part of another source, or show it otherwise."""
