from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
import torch

from dreamdrive.errors import InputError
from dreamdrive.geometry import GeometryOptions, reconstruct
from dreamdrive.geometry.backends.dust3r.align.aligned import Aligned
from dreamdrive.geometry.backends.dust3r.network.config import NetworkConfig
from dreamdrive.geometry.backends.dust3r.network.dust3r import Dust3r
from dreamdrive.geometry.backends.dust3r.network.images import resize_crop
from dreamdrive.geometry.backends.dust3r.pairs import make_pairs, video_graph
from dreamdrive.geometry.backends.dust3r.reconstruct import measured, planned_pairs
from dreamdrive.geometry.evidence import observe
from dreamdrive.geometry.finish import finish
from dreamdrive.geometry.measured import Measured
from dreamdrive.progress import Work
from dreamdrive.scene.clip import Clip, Known
from streetworld import make_street
from tests.geometry.backends.dust3r.network.networks import tiny
from tests.geometry.backends.dust3r.network.test_checkpoint import save_pth
from tests.streets import street_clip

FRAMES, SIZE = 6, (160, 96)
MODULE = import_module("dreamdrive.geometry.backends.dust3r.reconstruct")


@pytest.fixture(scope="module")
def drive():
    return make_street(5, FRAMES, 5.0, SIZE, movers=0)


@pytest.fixture(scope="module")
def clip(drive) -> Clip:
    return replace(street_clip(drive, 4), features={})


@pytest.fixture(scope="module")
def weights(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return save_pth(tmp_path_factory.mktemp("weights") / "tiny.pth", tiny(), img_size=(160, 160))


@pytest.mark.parametrize("factor", [1.0, 0.05])
def test_true_geometry_in_any_unit_comes_back_in_metres(drive, clip: Clip, factor: float):
    poses = drive.trajectory.world_from_camera.copy()
    poses[:, :3, 3] *= factor
    depth = (np.where(clip.held_out[:, None, None], 0, drive.depth_m) * factor).astype(np.float32)
    confidence = (depth > 0).astype(np.float32)
    found = finish(
        clip,
        Measured(poses, clip.rig[0], True, depth, confidence),
        observe(clip),
        GeometryOptions(camera_height_m=1.5),
    )
    truth = drive.trajectory.world_from_camera[-1, :3, 3]
    assert found.cameras[-1].world_from_camera[:3, 3] == pytest.approx(
        truth, abs=0.05 * np.linalg.norm(truth)
    )
    assert "ground plane" in found.scale.source
    assert not found.depth_m[clip.held_out].any()
    assert found.ground is not None


def test_a_unit_that_is_the_metre_is_kept(drive, clip: Clip):
    depth = np.where(clip.held_out[:, None, None], 0, drive.depth_m).astype(np.float32)
    poses = drive.trajectory.world_from_camera
    given = Measured(poses, clip.rig[0], True, depth, (depth > 0).astype(np.float32), unit="a metric network")
    found = finish(clip, given, observe(clip), GeometryOptions(camera_height_m=3.0))
    assert found.cameras[-1].world_from_camera == pytest.approx(poses[-1], abs=1e-6)
    assert found.scale.source == "a metric network"
    assert any("m above the road" in note for note in found.detected)


@pytest.mark.slow
def test_a_random_network_gives_a_geometry_that_says_what_it_is_worth(clip: Clip, weights: Path):
    told: list[tuple[int, int]] = []
    found = reconstruct(
        clip,
        GeometryOptions("dust3r", weights, camera_height_m=1.5),
        work=Work(lambda done, total: told.append((done, total))),
    )
    assert {total for _, total in told} == {FRAMES + len(make_pairs(FRAMES)) + 1}
    assert [done for done, _ in told] == sorted(done for done, _ in told)
    assert told[-1][0] == told[-1][1] - 1  # the alignment is left
    assert len(found.cameras) == FRAMES
    assert found.depth_m.shape == clip.frames.shape[:3]
    assert np.isfinite(found.depth_m).all()
    assert (found.depth_m[~clip.held_out] > 0).any()
    assert any("not to be believed" in note for note in found.detected)
    assert found.details["pairs_residual"] > 0


def test_weights_and_method_have_to_fit(clip: Clip, weights: Path, tmp_path: Path):
    with pytest.raises(InputError, match="--weights PATH"):
        reconstruct(clip, GeometryOptions(method="dust3r"))
    with pytest.raises(InputError, match="takes no weights"):
        reconstruct(clip, GeometryOptions(weights=weights))
    with pytest.raises(InputError, match="does not exist"):
        reconstruct(clip, GeometryOptions(method="dust3r", weights=tmp_path / "none.pth"))


def aligned(**changes: object) -> Aligned:
    flat = tuple(np.full(SIZE[::-1], 2, np.float32) for _ in range(FRAMES))
    one = Aligned(
        world_from_camera=np.tile(np.eye(4), (FRAMES, 1, 1)),
        focals_px=np.full(FRAMES, 100.0),
        depth=flat,
        pairs=(),
        confidence=flat,
        loss=0.0,
        losses=(),
        focal_error=0.05,
        network_focal_px=100.0,
        focal_spread=0.01,
        pair_spread=0.1,
        residual=np.zeros(1),
        masked_share=np.zeros(FRAMES),
        focal_observed=False,
        focal_agreed=True,
        path_observed=True,
    )
    return replace(one, **changes)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (
            {},
            "turns too little to show its focal length: it is the network's, which may be off by 5% or more",
        ),
        ({"focal_agreed": False, "focal_error": 0.1}, "the pairs do not agree on a focal length"),
        ({"focal_observed": True, "network_focal_px": 105.0, "focal_error": 0.01}, "4.8% shorter than"),
        ({"focal_observed": True, "network_focal_px": 101.0, "focal_error": 0.01}, None),
    ],
)
def test_what_shows_the_focal_length_is_said(clip: Clip, changes: dict[str, object], said: str | None):
    alone, found = replace(clip, known=Known()), aligned(**changes)
    seen = measured(alone, found, resize_crop(*SIZE, SIZE[0]))
    assert (seen.focal_observed, seen.focal_spread) == (found.focal_observed, found.focal_error)
    assert [said is not None and said in note for note in seen.notes] == ([] if said is None else [True])


def test_one_frame_is_too_few(clip: Clip, weights: Path):
    alone = replace(
        clip,
        **{
            name: getattr(clip, name)[:1]
            for name in ("frames", "times_s", "camera", "valid", "held_out", "source_index")
        },
    )
    with pytest.raises(InputError, match="two frames or more"):
        reconstruct(alone, GeometryOptions(method="dust3r", weights=weights))


def test_pairs_get_fewer_before_a_clip_is_refused():
    network = tiny()
    assert len(planned_pairs(network, 24, (512, 288))) == len(make_pairs(24, video_graph(24)))
    assert len(planned_pairs(network, 128, (512, 288))) < len(make_pairs(128, video_graph(128)))
    with pytest.raises(InputError, match=r"Aligning 250 images .* allowed: take fewer frames"):
        planned_pairs(network, 250, (512, 288))


def test_the_weights_count_when_pairs_are_planned(monkeypatch: pytest.MonkeyPatch):
    """Where the alignment alone would fit, the network and what it works with may not."""
    with torch.device("meta"):
        network = Dust3r(NetworkConfig())
    assert len(planned_pairs(network, 48, (512, 288))) == len(make_pairs(48, video_graph(48)))
    monkeypatch.setattr(MODULE, "BUDGET_BYTES", 4 * 10**9)
    assert len(planned_pairs(network, 48, (512, 288))) == len(make_pairs(48, "swin-2-noncyclic"))
    with pytest.raises(InputError, match=r"DUSt3R on 378 pairs of 96 frames needs .* take fewer frames"):
        planned_pairs(network, 96, (512, 288))
