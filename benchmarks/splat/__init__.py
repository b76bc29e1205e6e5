"""Splatting and training steps: the parts of ``splat.py``, ``scale.py``, ``train_step.py`` and ``gpu.py``."""
