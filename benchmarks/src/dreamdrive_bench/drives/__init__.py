"""Recorded drives: which, what is known of them, and what a scene of each is worth."""
