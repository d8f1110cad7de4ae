"""What a data set says about itself: info.json, its demonstrations, names, cameras and paths."""
