"""The default score: each demonstration against what most of the pool does."""
