"""What HDF5 files of other tools hold: pictures, logs of numbers, facts."""
