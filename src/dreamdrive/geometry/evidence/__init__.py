"""What can be seen in the frames alone: features, motion, regions fixed to the camera."""
