"""How a run is kept apart from others, and what it says."""
