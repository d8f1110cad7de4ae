"""What changes in the picture for good, and what of it others do not show."""
