"""In which ways the demonstrations of a pool carry out a task, and what that may mean."""
