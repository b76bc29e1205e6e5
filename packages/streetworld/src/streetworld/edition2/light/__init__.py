"""Light, weather and glass of edition 2."""
