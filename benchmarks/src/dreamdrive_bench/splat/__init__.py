"""Splatting and training steps: the parts of ``splat``, ``scale``, ``train_step`` and ``gpu``."""
