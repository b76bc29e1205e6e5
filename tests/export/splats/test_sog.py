import io
import json
import zipfile
from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image

from dreamdrive.data.splats.ply import unpack_ply
from dreamdrive.export.splats.sog import pack_sog
from dreamdrive.scene.gaussians import Gaussians
from tests.data.splats.some import check_same, some
from tests.export.splats.transform import transformed

_NEAR = {"place_m": 0.03, "size": 0.12, "opacity": 0.003, "colour": 0.03}


def _in_order(found: Gaussians, true: Gaussians) -> Gaussians:
    """Found ones in the order of the true ones: the format may sort them."""
    return found.select(torch.cdist(true.means, found.means).argmin(dim=1))


@pytest.mark.slow
@pytest.mark.parametrize("coefficients", [1, 4, 16])
def test_splat_transform_reads_sog(tmp_path: Path, coefficients: int) -> None:
    true = some(300, coefficients)
    (tmp_path / "a.sog").write_bytes(pack_sog(true))
    found, _ = unpack_ply(transformed(tmp_path / "a.sog"), "a").gaussians("a")
    assert found.sh.shape == true.sh.shape
    check_same(_in_order(found, true), true, **_NEAR)


def test_pillow_reads_its_pictures() -> None:
    true = some(50, 4)
    archive = zipfile.ZipFile(io.BytesIO(pack_sog(true)))
    about = json.loads(archive.read("meta.json"))

    def rows(name: str) -> np.ndarray:
        picture = Image.open(io.BytesIO(archive.read(name)))
        assert picture.format == "WEBP"
        return np.array(picture).reshape(-1, len(picture.getbands()))[:50]

    wholes = rows("means_l.webp")[:, :3] + 256 * rows("means_u.webp")[:, :3].astype(int)
    low, high = (np.array(about["means"][name]) for name in ("mins", "maxs"))
    logs = low + (high - low) * wholes / 65535
    assert np.allclose(np.sign(logs) * np.expm1(np.abs(logs)), true.means, atol=0.03)
    levels = np.array(about["sh0"]["codebook"])
    assert np.allclose(levels[rows("sh0.webp")[:, :3]], true.sh[:, 0], atol=0.02)
    assert np.allclose(rows("sh0.webp")[:, 3] / 255, torch.sigmoid(true.logit_opacities), atol=0.002)
    assert (about["version"], about["count"], about["shN"]["bands"]) == (2, 50, 1)


def test_the_same_scene_gives_the_same_bytes() -> None:
    assert pack_sog(some(20, 4)) == pack_sog(some(20, 4))


@pytest.mark.slow
def test_many_colours_become_a_palette() -> None:
    true = some(6000, 4)
    archive = zipfile.ZipFile(io.BytesIO(pack_sog(true)))
    about = json.loads(archive.read("meta.json"))["shN"]
    assert about["count"] == 2048
    picture = np.array(Image.open(io.BytesIO(archive.read("shN_labels.webp"))))
    labels = picture.reshape(-1, picture.shape[-1])[:6000].astype(int)
    centroids = np.array(Image.open(io.BytesIO(archive.read("shN_centroids.webp"))))[..., :3]
    palette = np.array(about["codebook"])[centroids].reshape(-1, 3, 3)
    found = palette[labels[:, 0] + 256 * labels[:, 1]]
    assert np.sqrt(np.square(found - true.sh[:, 1:].numpy()).mean()) < 0.2
