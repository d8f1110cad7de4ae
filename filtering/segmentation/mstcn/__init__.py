"""MS-TCN++: the network, its training, the segmenter that uses it, and its checkpoint."""
