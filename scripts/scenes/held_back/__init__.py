"""Scenes that nobody looks at who chooses constants, until everything has been chosen."""
