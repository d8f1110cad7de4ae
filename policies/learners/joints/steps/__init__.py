"""Control steps of a pool as the networks of joint targets are given them."""
