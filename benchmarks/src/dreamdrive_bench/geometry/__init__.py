"""Ways of getting geometry, and DUSt3R's alignment of simulated pairs: the parts of ``geometry``."""
