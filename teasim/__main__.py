"""`python -m teasim` is the same as the command `teasim`."""

import sys

from teasim.cli.main import main

if __name__ == "__main__":
    sys.exit(main())
