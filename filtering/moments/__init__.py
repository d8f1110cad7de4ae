"""Evidence from moments: where each moment of a video has its counterpart in the others."""
