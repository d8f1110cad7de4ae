"""Learners of joint targets from the state: in one step, with a memory, in chunks."""
