"""Edited scenes against streets that are drawn with the same edit."""
