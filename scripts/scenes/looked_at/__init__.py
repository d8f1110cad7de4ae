"""Scenes that were kept back until they were looked at; constants are chosen on them now."""
