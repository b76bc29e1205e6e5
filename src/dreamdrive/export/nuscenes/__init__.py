"""Drives as data sets in the format of nuScenes."""
