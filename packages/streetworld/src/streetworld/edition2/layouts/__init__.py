"""Layouts of edition 2: what a street consists of, and where it lies."""
