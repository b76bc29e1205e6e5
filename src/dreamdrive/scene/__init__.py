"""The nouns: what the stages hand to each other, and the scene folder on disk."""
