"""The street network against lidar, known cameras and drawn streets: the parts of ``knowledge``."""
