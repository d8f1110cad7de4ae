"""Looks of the station: what differs between the pictures of demonstrations and is not physics."""
