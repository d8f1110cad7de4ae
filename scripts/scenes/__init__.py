"""Small seeded scenes of different kinds, for checking a filter that is tuned to none of them."""
