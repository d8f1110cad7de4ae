"""Pictures in, features out: frames, backgrounds, the backbone and its cache."""
