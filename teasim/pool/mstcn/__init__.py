"""The folder format of MS-TCN: labels per frame, features, predictions."""
