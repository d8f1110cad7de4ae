"""The learned decision: the probability that a demonstration is incorrect, given the whole pool."""
