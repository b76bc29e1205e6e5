"""Parts of ``perception.py``."""
