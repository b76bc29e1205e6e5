"""How well trust in a view goes with its true error."""
