"""How the street network is trained."""
