"""From the frames of a segment to a short feature vector."""
