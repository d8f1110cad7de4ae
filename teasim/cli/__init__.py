"""The command `teasim`: a dispatcher, and the verbs of this package."""
