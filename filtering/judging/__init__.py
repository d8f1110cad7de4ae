"""From evidence to a weight per demonstration, the flagged ones and the reasons."""
