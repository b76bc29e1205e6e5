"""Parts of ``photo.py``."""
