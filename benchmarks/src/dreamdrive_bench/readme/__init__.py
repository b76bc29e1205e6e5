"""The figures of the README: the parts of ``readme``."""
