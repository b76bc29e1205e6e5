"""How a run is shown: what it will cost, and how it went."""
