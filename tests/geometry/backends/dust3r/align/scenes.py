"""Scenes of the golden alignments, and the authors' runs on them."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
import torch

from dreamdrive.geometry.backends.dust3r.pairs import PairMaps
from dreamdrive_bench.geometry.authors_alignment import Raw
from tests.golden import reading
from tests.golden.reading import Table

PNP = 1e-3
"""Share of a path or a depth by which a pose from PnP may differ, which ends where its steps become small."""


@dataclass(frozen=True)
class Scene:
    """Pairs, all inputs (with the truth), and what the authors' program made of them."""

    name: str
    maps: PairMaps
    inputs: Table
    outputs: Table

    @property
    def images(self) -> int:
        return len(self.inputs["gt.cam2world"])

    def settings(self, run: str) -> dict[str, Any]:
        """Of a run: steps, rates, the tree it began with."""
        return reading.values("dust3r/align_config.json")[f"{self.name}.{run}"]

    def posed_by_pnp(self, run: str) -> list[int]:
        """Images that are the first of no edge of the tree."""
        first = {edge["edge"][0] for edge in self.settings(run)["tree"]}
        return [image for image in range(self.images) if image not in first]


def scene(name: str) -> Scene:
    """The scene of a name such as A."""
    inputs = reading.arrays(f"dust3r/align_{name}_inputs.safetensors")
    outputs = reading.arrays(f"dust3r/align_{name}_outputs.safetensors")
    numbers = range(len(inputs["edges"]))
    points = tuple((inputs[f"p1.{e}"], inputs[f"p2.{e}"]) for e in numbers)
    confidence = tuple((inputs[f"c1.{e}"], inputs[f"c2.{e}"]) for e in numbers)
    return Scene(name, PairMaps(inputs["edges"], points, confidence), inputs, outputs)


def names() -> list[str]:
    """All scenes."""
    files = sorted((reading.FOLDER / "dust3r").glob("align_*_outputs.safetensors"))
    return [file.name.removeprefix("align_").removesuffix("_outputs.safetensors") for file in files]


def scenes_with(entry: str) -> list[Any]:
    """Names of the scenes whose outputs have an entry, for ``parametrize``."""
    found = [name for name in names() if entry in reading.cases(f"dust3r/align_{name}_outputs.safetensors")]
    return found or [pytest.param("", marks=pytest.mark.skip(reason=f"no golden scene has {entry}"))]


def runs_with(entry: str) -> list[Any]:
    """Names of scenes and of those of their runs that have an entry, for ``parametrize``."""
    pattern = r"(\w+)\." + entry.replace(".", r"\.")
    found = [
        (name, run)
        for name in names()
        for run in reading.cases(f"dust3r/align_{name}_outputs.safetensors", pattern)
        if isinstance(run, str) and run not in ("raw", "grad")
    ]
    return found or [pytest.param("", "", marks=pytest.mark.skip(reason=f"no golden run has {entry}"))]


def raw(outputs: Table) -> Raw:
    """The authors' raw parameters after their initialisation."""
    names = ("pw_poses", "im_poses", "im_focals", "im_depthmaps")
    return Raw(*(torch.tensor(outputs[f"raw.{name}"], requires_grad=True) for name in names))


def nudged(parameters: Raw, seed: int) -> Raw:
    """The parameters with as much noise as rounding makes: 1e-7 of the largest of their kind."""
    draw = torch.Generator().manual_seed(seed)
    parts = [part.detach() for part in parameters.tensors]
    noise = [1e-7 * part.abs().max() * torch.randn(part.shape, generator=draw) for part in parts]
    return Raw(*((part + more).requires_grad_(True) for part, more in zip(parts, noise, strict=True)))


def extent(poses: np.ndarray) -> float:
    """Greatest distance of a camera from the first: what places in a path are measured by."""
    return float(np.linalg.norm(poses[:, :3, 3] - poses[0, :3, 3], axis=1).max())


def check_poses(found: np.ndarray, expected: np.ndarray, limit: float) -> None:
    """Assert that rotations (N, 3, 3) differ by the limit and places by that share of the path."""
    np.testing.assert_allclose(found[:, :3, :3], expected[:, :3, :3], atol=limit)
    np.testing.assert_allclose(found[:, :3, 3], expected[:, :3, 3], atol=limit * extent(expected))
