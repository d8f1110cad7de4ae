"""Demonstrations in, policies and their scores out (the paper, section 4.3)."""
