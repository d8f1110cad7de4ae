"""The command `teasim`: a dispatcher and the verbs of the ground floor."""
