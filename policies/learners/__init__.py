"""The learners, one file each, and what their networks are made of."""
