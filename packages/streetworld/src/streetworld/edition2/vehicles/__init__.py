"""Vehicles of edition 2."""
