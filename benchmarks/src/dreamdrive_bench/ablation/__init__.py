"""Hybrid with one thing changed: the parts of ``ablation``."""
