"""Truth in place of parts of a scene."""
