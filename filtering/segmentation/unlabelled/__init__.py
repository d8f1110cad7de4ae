"""Segments without a label: clustering of the videos, and what counterparts agree on."""
