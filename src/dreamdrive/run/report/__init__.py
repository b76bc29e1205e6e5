"""Reports of a run: its cost before, its results after."""
