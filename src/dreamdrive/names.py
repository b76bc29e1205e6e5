"""Names that can be chosen from, known without loading what they stand for."""

from typing import Literal

QualityName = Literal["draft", "standard", "high"]
MethodName = Literal["dreamdrive", "paper"]
TrafficName = Literal["still", "flow"]
RepresentationName = Literal["static", "deformable", "hexplane", "vibration", "hybrid"]
DeviceName = str
"""``cpu``, ``cuda`` or ``cuda:N``; ``compute.device.computing_on`` refuses what is none."""
Stage = Literal["prior", "look", "geometry", "initialise", "static", "score", "group", "fit"]
Show = Literal["colour", "depth", "dynamic", "static", "trust"]
Format = Literal["mp4", "png", "npz"]
PlanMethod = Literal["avoid", "uniad"]
DtypeName = Literal["float16", "float32"]
Resize = Literal["tf1", "torch", "antialias", "clean"]
"""tf1: bilinear of TensorFlow 1 without half-pixel centres (torch-fidelity); torch: bilinear (pytorch-fid);
antialias: the same with antialiasing (torchmetrics); clean: antialiased bicubic (clean-fid)."""
Covariance = Literal["sample", "population"]
FILL_NETWORK, FILL_INPAINT = "network", "inpaint"
"""What fills what a photo does not show, in place of a file: the weights that ship, no network at all."""
Stlpips = Literal["alex", "vgg", "both"]
"""Trunk of the shift-tolerant LPIPS; that of VGG takes four times as long."""
