"""Data sets written by this project, and copies of others with some of their demonstrations."""
