"""Experiments that run the filter before training; no other part of policies imports it."""
