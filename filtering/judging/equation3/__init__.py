"""Equation 3 of the paper: the problem, its solvers, and the score of a demonstration."""
