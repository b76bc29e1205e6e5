"""Figures of how real sets of clips look."""
