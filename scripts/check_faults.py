"""Kill the writer of pools and conversions to every format at random moments.

Each is resumed until it is finished, and must then equal an uninterrupted one byte for byte.
"""

import runpy
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

if __name__ == "__main__":
    runpy.run_module("tests.pool.faults", run_name="__main__")
