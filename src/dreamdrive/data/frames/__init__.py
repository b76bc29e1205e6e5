"""Frames of a source: their choice, their times, and remarks on them."""
