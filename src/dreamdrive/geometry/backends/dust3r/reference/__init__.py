"""What the authors' program does, as the measure of what is done here; no clip goes through it."""
