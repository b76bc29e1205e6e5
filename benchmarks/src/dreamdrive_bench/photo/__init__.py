"""Parts of ``photo``."""
