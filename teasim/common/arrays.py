"""The array type that most signatures use."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
"""Double-precision numbers; each signature gives the shape."""
