"""Parts of ``perception``."""
