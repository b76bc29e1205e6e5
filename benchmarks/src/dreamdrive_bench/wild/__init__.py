"""Parts of ``wild``."""
