"""The truth about a scene's frames, drawn or recorded."""
