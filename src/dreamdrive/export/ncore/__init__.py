"""Drives in NVIDIA NCore V4."""
