"""The learners, one file each, and the networks and policies they produce."""
