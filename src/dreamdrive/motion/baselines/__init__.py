"""Representations that the hybrid one is compared with (Table I)."""
