"""The task: its sub-tasks, correct orders, mistakes, and how an episode is scored."""
