"""Parts of ``wild.py``."""
