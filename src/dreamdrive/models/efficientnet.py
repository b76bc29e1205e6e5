"""The shape of EfficientNet-Lite0 (Tan and Le 2019, table 1; no squeeze-and-excitation, ReLU6 for swish)."""

LITE0_STAGES = (
    (3, 1, 1, 16, 1),
    (3, 2, 6, 24, 2),
    (5, 2, 6, 40, 2),
    (3, 2, 6, 80, 3),
    (5, 1, 6, 112, 3),
    (5, 2, 6, 192, 4),
    (3, 1, 6, 320, 1),
)
"""Kernel, stride, widening, channels and repetitions of each stage."""
