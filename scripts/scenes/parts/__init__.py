"""What the scenes have in common: drawing, a gantry, writing pools."""
