"""Input of the learners: samples read from pools, and a weight per demonstration."""
