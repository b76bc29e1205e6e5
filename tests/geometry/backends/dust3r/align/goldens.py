"""Scenes of the golden alignment files."""

import json
from pathlib import Path

import numpy as np
import torch
from safetensors.numpy import load_file

from dreamdrive.geometry.backends.dust3r.pairmaps import PairMaps
from dreamdrive.geometry.backends.dust3r.reference.objective import Raw


def scene(golden_dir: Path, name: str) -> tuple[PairMaps, dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Pairs, all inputs (with the truth) and all outputs of scene A, B or C."""
    inputs = load_file(golden_dir / f"dust3r/align_{name}_inputs.safetensors")
    outputs = load_file(golden_dir / f"dust3r/align_{name}_outputs.safetensors")
    numbers = range(len(inputs["edges"]))
    points = tuple((inputs[f"p1.{e}"], inputs[f"p2.{e}"]) for e in numbers)
    confidence = tuple((inputs[f"c1.{e}"], inputs[f"c2.{e}"]) for e in numbers)
    return PairMaps(inputs["edges"], points, confidence), inputs, outputs


def raw(outputs: dict[str, np.ndarray]) -> Raw:
    """Upstream's raw parameters after its initialisation."""
    names = ("pw_poses", "im_poses", "im_focals", "im_depthmaps")
    return Raw(*(torch.tensor(outputs[f"raw.{name}"], requires_grad=True) for name in names))


def config(golden_dir: Path) -> dict[str, dict[str, float]]:
    """Figures of upstream's runs."""
    return json.loads((golden_dir / "dust3r/align_config.json").read_text())
