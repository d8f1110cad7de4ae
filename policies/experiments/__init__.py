"""Filter, then train: the only room that sees the filter."""
