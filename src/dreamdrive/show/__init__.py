"""All drawing: videos, panels, pictures of the geometry, renderings of drives."""
