"""From a video to its segments."""
