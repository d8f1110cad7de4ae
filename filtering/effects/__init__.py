"""Effects of segments: the video at rest before and after each one."""
