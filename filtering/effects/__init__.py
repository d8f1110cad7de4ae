"""What came of a segment: the video at rest before and after it."""
