"""Image processing without a scene: flow, likeness, windows, linked pixels."""
