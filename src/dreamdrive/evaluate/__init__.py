"""Measures of a result: how well it holds together, and how far it is from the truth."""
