"""Evidence of motion in posed frames, outlines of moving things, oncoming traffic."""
