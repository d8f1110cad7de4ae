"""What it means: the sub-tasks, the recipes, the mistakes, and how an episode is scored."""
