"""Drives in MCAP, for Foxglove."""
