"""Plane sweep, its smoothing and its confidence."""
