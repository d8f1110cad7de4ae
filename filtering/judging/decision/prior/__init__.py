"""The prior: random tasks, and pools of demonstrations of them with the truth about each."""
