"""Data sets of the field, read as logs and clips."""
