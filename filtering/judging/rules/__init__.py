"""What a user knows about a task: rules of order, legal orders, optional and critical steps."""
