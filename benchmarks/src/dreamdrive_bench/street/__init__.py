"""Drawn streets with a truth, five representations of motion: the parts of ``street``."""
