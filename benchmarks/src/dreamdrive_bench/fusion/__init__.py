"""What the street network brings: drawn streets and recordings."""
