"""One file per table or figure: its work, its rows, and sentences computed from them."""
