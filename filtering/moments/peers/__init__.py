"""With whom a demonstration is compared: the trusted ones that look like it."""
