"""Plans against recorded drives."""
