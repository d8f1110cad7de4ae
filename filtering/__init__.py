"""Videos in, a weight per video out: finds incorrect demonstrations without labels."""
