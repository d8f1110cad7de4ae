"""What learners are given: samples read from pools, and a weight per demonstration."""
