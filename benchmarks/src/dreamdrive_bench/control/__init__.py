"""Layouts with one thing changed, and how scenes follow: the parts of ``control``."""
