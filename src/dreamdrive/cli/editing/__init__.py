"""Commands on the actors of a scene."""
