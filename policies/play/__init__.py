"""Policies in the environment: episodes, scores, comparisons."""
