"""Figures that stages and evaluations share: how far paths lie apart, and what a score retrieves."""
