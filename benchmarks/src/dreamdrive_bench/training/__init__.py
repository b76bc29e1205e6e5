"""Parts of ``training``: packs, limits, and one module for each network that is trained so."""
