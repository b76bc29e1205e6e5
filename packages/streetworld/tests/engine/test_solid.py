"""Rays against triangles, and the picture whatever instructions they are traced with."""

import os
import platform
import subprocess
import sys
from pathlib import Path

import embreex
import numpy as np
import pytest
from embreex.rtcore import EmbreeDevice
from hypothesis import given, strategies as st

from dreamdrive.scene.level import upright
from streetworld.engine.mesh import Mesh, ball, box, cylinder, frustum
from streetworld.engine.solid import Solid

DEVICE = EmbreeDevice()
DEVICE_CODE = """
#include <dlfcn.h>
#include <stdlib.h>
void* rtcNewDevice(const char* config) {
  (void)config;
  void* library = dlopen(getenv("EMBREE"), RTLD_NOW);
  void* (*make)(const char*) = (void* (*)(const char*))dlsym(library, "rtcNewDevice");
  return make(getenv("EMBREE_CONFIG"));
}
"""
CODE = """
import sys, numpy as np
from streetworld import make_street
street = make_street(2, 1, size=(320, 192))
np.savez(sys.argv[1], frame=street.frames[0], depth=street.depth_m[0], instance=street.instance[0])
"""


def solid(mesh: Mesh) -> Solid:
    return Solid(mesh, np.zeros(len(mesh), dtype=np.int64), DEVICE)


@given(st.floats(-3, 3), st.floats(-3, 3), st.floats(0.2, 4))
def test_a_ray_meets_a_box_where_it_should(x: float, y: float, size: float) -> None:
    made = solid(box((0, 0, 0), (size, size, size), 0))
    hits = made.first_hits(np.array([x, y, 10.0]), np.array([[0.0, 0, -2]]))
    inside = max(abs(x), abs(y)) < size / 2 - 1e-4
    outside = max(abs(x), abs(y)) > size / 2 + 1e-4
    if inside:
        np.testing.assert_allclose(hits.distance, (10 - size / 2) / 2, rtol=1e-12)
        np.testing.assert_allclose(made.normals[hits.triangle], [[0, 0, 1]], atol=1e-6)
    elif outside:
        assert hits.triangle.tolist() == [-1]


def test_bodies_face_outwards_and_are_closed() -> None:
    square = (-1.0, 1.0, -1.0, 1.0)
    for mesh in (
        box((0, 0, 0), (2, 3, 4), 0),
        frustum(square, (-0.5, 0.5, -0.5, 0.5), (-1, 1), [0] * 6),
        cylinder((0, 0, -1), (0, 0, 1), (1, 0.5), 0, 0, 12),
        ball((0, 0, 0), (1, 1, 1), 0, 6),
    ):
        corners = mesh.corners
        across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        centre = corners.mean(axis=1)
        assert (np.einsum("mi,mi->m", across, centre) > -1e-9).all()
        # The surface of a closed body has no net direction.
        np.testing.assert_allclose(across.sum(axis=0), 0, atol=1e-9)


def test_texture_places_follow_the_triangle() -> None:
    rng = np.random.default_rng(0)
    mesh = Mesh(rng.normal(size=(20, 3, 3)), rng.normal(size=(20, 3, 2)), np.zeros(20, dtype=np.int64))
    made = solid(mesh)
    homogeneous = np.concatenate([mesh.corners, np.ones((20, 3, 1))], axis=-1)
    found = np.einsum("mki,mci->mck", made.to_uv, homogeneous)
    np.testing.assert_allclose(found, mesh.uv, atol=1e-3)


def test_what_lies_between_hides_the_sun() -> None:
    made = solid(box((0, 0, 5), (1, 1, 1), 0).moved(upright((1, 0, 0))))
    points = np.array([[1.0, 0, 0], [3, 0, 0]], dtype=np.float32)
    assert made.hidden(points, np.array([0.0, 0, 1])).tolist() == [True, False]


@pytest.fixture(scope="module")
def forced(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A library that opens Embree's device with the settings of EMBREE_CONFIG: embreex passes none on."""
    folder = tmp_path_factory.mktemp("forced")
    (folder / "device.c").write_text(DEVICE_CODE)
    made = folder / "device.so"
    subprocess.run(["cc", "-shared", "-fPIC", str(folder / "device.c"), "-o", str(made), "-ldl"], check=True)
    return made


@pytest.mark.skipif(platform.machine() != "x86_64", reason="names of x86 instruction sets")
@pytest.mark.slow
def test_other_instructions_give_the_same_picture(forced: Path, tmp_path: Path) -> None:
    libraries = Path(embreex.__file__).parents[1] / "embreex.libs"
    embree = next(libraries.glob("libembree4*"))
    seen = []
    for isa in ("avx2", "sse2"):
        file = tmp_path / f"{isa}.npz"
        settings = {"EMBREE": str(embree), "EMBREE_CONFIG": f"isa={isa},verbose=2", "LD_PRELOAD": str(forced)}
        done = subprocess.run(
            [sys.executable, "-c", CODE, str(file)],
            check=True,
            capture_output=True,
            env=os.environ | settings,
        )
        used = [line for line in done.stdout.decode().splitlines() if "(supported)" in line]
        assert ("AVX2" in used[0]) == (isa == "avx2")
        with np.load(file) as kept:
            seen.append({key: kept[key] for key in kept.files})
    first, second = seen
    step = np.abs(first["frame"].astype(int) - second["frame"]).max(axis=-1)
    assert (step <= 1).mean() >= 0.999
    assert (first["instance"] == second["instance"]).mean() >= 0.999
