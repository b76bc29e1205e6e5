"""Actors made of moving clusters: paths, bodies, life spans."""
