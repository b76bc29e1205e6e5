"""Recordings with and without cuts: the parts of ``cuts``."""
