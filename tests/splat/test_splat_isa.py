"""Every instruction set of the core, each in a process of its own: the choice is made once a process.

They are forks of one process, so that what they import is loaded once.
"""

import os
import subprocess
import sys
import traceback
from itertools import combinations
from pathlib import Path

import pytest
import torch
from torch import Tensor

from dreamdrive.scene.render import Render
from dreamdrive.splat import native_info, ssim_map
from dreamdrive.splat.ssim import ssim_map_reference
from tests.splat.agreement import (
    assert_gradients_agree,
    assert_images_agree,
    assert_inspections_agree,
    edges,
    pull,
)
from tests.splat.drawn import KINDS, Case, build

ROOT = Path(__file__).resolve().parents[2]
ISAS, UNKNOWN = ("baseline", "avx2", "avx512"), "pentium"
# Counts that fill no row of lanes, sizes that fill no tile; every degree and every kind.
CASES = (
    Case(1, n=3, size_px=(5, 7), degree=0, stored=0, channels=None, offsets=False),
    Case(2, n=61, kinds=KINDS, size_px=(45, 35), degree=1, stored=2, channels=1),
    Case(
        3, n=127, kinds=("plain", "opaque", "needle"), size_px=(33, 17), degree=2, stored=2, antialiased=True
    ),
    Case(
        4, n=250, kinds=("plain", "beside"), size_px=(65, 30), degree=3, stored=3, absolute=True, inspect=True
    ),
)


def photos() -> tuple[Tensor, Tensor]:
    g = torch.Generator().manual_seed(0)
    return torch.rand(37, 29, 3, generator=g), torch.rand(37, 29, 3, generator=g)


def results() -> dict[str, object]:
    """Every case's images and gradients, and SSIM with its gradient, on this process's instruction set."""
    splats = []
    for case in CASES:
        scene = build(case)
        value, gradients = pull(case, scene, edges(case, scene).sure)
        splats.append((vars(value), gradients))
    image, target = photos()
    similarity = ssim_map(image.requires_grad_(), target)
    similarity.square().sum().backward()
    return {**native_info(), "splats": splats, "ssim": (similarity.detach(), image.grad)}


def write_in_a_fork(isa: str, folder: Path) -> None:
    """The results on an instruction set, or the reason why there are none."""
    child = os.fork()
    if child:
        os.waitpid(child, 0)
        return
    os.environ["DREAMDRIVE_ISA"] = isa
    try:
        torch.save(results(), folder / isa)
    except BaseException:  # noqa: BLE001
        (folder / f"{isa}.txt").write_text(traceback.format_exc())
    finally:
        os._exit(0)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Files of results or of reasons."""
    folder = tmp_path_factory.mktemp("isa")
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    command = [sys.executable, "-m", "tests.splat.test_splat_isa", folder]
    subprocess.run(command, cwd=ROOT, env=environment, check=True)
    return folder


@pytest.fixture(scope="module")
def by_isa(made: Path) -> dict[str, dict]:
    """The results of each instruction set that this machine has."""
    found = {isa: torch.load(made / isa) for isa in ISAS if (made / isa).is_file()}
    for isa in set(ISAS) - set(found):
        why = (made / f"{isa}.txt").read_text()
        assert "this machine lacks it" in why or "x86 only" in why, why
    return found


@pytest.mark.parametrize("isa", ISAS)
def test_each_instruction_set_agrees_with_the_reference(by_isa, isa):
    if isa not in by_isa:
        pytest.skip(f"this machine lacks {isa}")
    assert by_isa[isa]["isa"] == isa
    for case, (value, gradients) in zip(CASES, by_isa[isa]["splats"], strict=True):
        scene = build(case)
        where = edges(case, scene)
        expected, expected_gradients = pull(case, scene, where.sure, "reference")
        assert_images_agree(Render(**value), expected, where)
        assert_gradients_agree(gradients, expected_gradients, where)
        if case.inspect:
            assert_inspections_agree(Render(**value), expected, where)
    image, target = (photo.double() for photo in photos())
    similarity = ssim_map_reference(image.requires_grad_(), target)
    similarity.square().sum().backward()
    for value, expected in zip(by_isa[isa]["ssim"], (similarity.detach(), image.grad), strict=True):
        torch.testing.assert_close(value.double(), expected, rtol=1e-3, atol=1e-4)


def test_instruction_sets_agree_with_each_other(by_isa):
    if len(by_isa) < 2:
        pytest.skip("this machine has one instruction set")
    for a, b in combinations(by_isa.values(), 2):
        for case, (value, gradients), (other, by_other) in zip(CASES, a["splats"], b["splats"], strict=True):
            scene = build(case)
            where = edges(case, scene)
            assert_images_agree(Render(**value), Render(**other), where)
            assert_gradients_agree(gradients, by_other, where)
            if case.inspect:
                assert_inspections_agree(Render(**value), Render(**other), where)


def test_unknown_instruction_set_is_refused(made):
    assert not (made / UNKNOWN).exists()
    assert "expected baseline, avx2 or avx512" in (made / f"{UNKNOWN}.txt").read_text()


if __name__ == "__main__":
    for each in (*ISAS, UNKNOWN):
        write_in_a_fork(each, Path(sys.argv[1]))
