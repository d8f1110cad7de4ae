"""Intervals of activation as a graph of temporal relations, and its classifier."""
