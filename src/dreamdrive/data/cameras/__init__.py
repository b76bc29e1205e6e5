"""Cameras on disk: calibration, lenses, poses."""
