"""Training of the networks that ship with dreamdrive."""

__version__ = "0.1.0"
