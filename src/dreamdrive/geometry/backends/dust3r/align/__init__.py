"""Global alignment: from pointmaps of pairs to one world (Wang et al. 2024, section 3.4)."""
