"""Views mended with recorded frames: where a frame shows the same surface, and what a network makes of it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import given, strategies as st
from safetensors.torch import save_file

from dreamdrive.data.pictures.picture_file import frame_of, kept_frame
from dreamdrive.errors import InputError
from dreamdrive.motion import DeformationConfig, DeformationField, Domain, Tracks
from dreamdrive.restore import CHANNELS, Recordings, Restorer, RestorerNetwork, load_restorer
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.scene import Scene
from dreamdrive.splat import render_scene
from dreamdrive.trust import evidence_of
from tests.walls import CAMERA, board, pose_at, street

SIZE = CAMERA.width_px, CAMERA.height_px
SAME, SURE = slice(8, 11), 11


def wall() -> Scene:
    """A wall whose colours are wide enough to be sampled between pixels."""
    return replace(street(), static=board(14.0, (-14, 14), (-8, 8), 1.2))


def off(told: np.ndarray) -> float:
    """Median difference of the frame that is carried over and the view, where it surely shows the same."""
    return float(np.median(np.abs(told[SAME] - told[:3]).mean(axis=0)[told[SURE] > 0.8]))


def filmed(scene: Scene) -> Scene:
    """The scene with frames of itself, but of the last view, which is withheld."""
    frames = [
        kept_frame(render_scene(scene, camera, float(t_s)).picture)
        for camera, t_s in zip(scene.cameras, scene.times_s, strict=True)
    ]
    held_out = np.arange(len(frames)) == len(frames) - 1
    return replace(scene, frames=(*frames[:-1], b""), held_out=held_out)


def recordings(scene: Scene) -> Recordings:
    assert scene.residual is not None
    return Recordings.of(scene, evidence_of(scene, np.square(scene.residual.astype(np.float32))))


def aside(view: int, right_m: float) -> tuple:
    camera = CAMERA.at(pose_at(0.5 * view)).moved(right_m)
    return camera, view / 10


def test_a_frame_shows_the_surface_from_aside() -> None:
    scene = filmed(wall())
    seen, told = recordings(scene).told(*aside(3, 1.0))
    assert told.shape == (CHANNELS, CAMERA.height_px, CAMERA.width_px)
    sure = told[SURE] > 0.8
    # The wall is 12.5 m away and the frame ends 6 px before the view does.
    assert 0.85 < sure.mean() < 0.97
    assert off(told) < 0.03
    assert (told[SURE][:, -5:] == 0).all()
    torch.testing.assert_close(seen.colour.permute(2, 0, 1), torch.from_numpy(told[:3]))


def test_a_frame_does_not_show_what_stands_behind_something() -> None:
    """From aside the wall behind a post is seen that the post hides in the frame."""
    bare = street()
    post = board(7.0, (-0.5, 0.5), (-4, 4), 0.1, seed=1)
    both = filmed(replace(bare, static=Gaussians.concatenate(bare.static, post)))
    _, told = recordings(both).told(*aside(0, 1.5))
    # In the frame the post covers columns 42 to 54; the wall behind those is 8.6 px further left in the view.
    hidden, beside = told[SURE][32, 38:44], told[SURE][32, 60:80]
    assert hidden.max() < 0.05
    assert beside.min() > 0.8


def sliding() -> DeformationField:
    """Moves it to the right by 2 m/s."""
    times_s = np.arange(8) / 10
    translation_m = np.zeros((1, 8, 3))
    translation_m[0, :, 0] = 2 * times_s
    tracks = Tracks(times_s, translation_m, np.zeros((1, 8)), np.zeros((1, 3)))
    config = DeformationConfig(depth=1, width=4, actors=1, track_times=8)
    domain = Domain(np.zeros(3), 50.0, 0.0, 1.0, np.array([0, -1.0, 0]))
    return DeformationField(config, domain, tracks).requires_grad_(False)


def test_what_moves_is_taken_from_a_frame_of_the_same_time_alone() -> None:
    still = wall()
    none = still.static.select(torch.zeros(0, dtype=torch.int64))
    mover = replace(
        still.static,
        actor=torch.zeros(len(still.static), dtype=torch.int64),
        lifespan=torch.tensor([[0.3, 100.0]]).repeat(len(still.static), 1),
    )
    found = recordings(filmed(replace(still, static=none, dynamic=mover, deformation=sliding())))
    sure = [SURE, SURE + 4]
    _, told = found.told(*aside(3, 0.0))
    assert told[sure[0]].max() > 0.9
    _, told = found.told(*aside(3, 0.0), besides=3)
    assert told[sure].max() < 0.1
    # What stands there is.
    standing = recordings(filmed(still))
    _, told = standing.told(*aside(3, 0.0), besides=3)
    assert told[sure].max() > 0.9


def test_a_street_that_moves_per_frame_is_found_where_it_was(monkeypatch) -> None:
    still, lasting = wall(), torch.tensor([[0.3, 100.0]])
    count = len(still.static)
    moving = replace(
        still.static,
        velocity=torch.tensor([[6.0, 0, 0]]).repeat(count, 1),
        lifespan=lasting.repeat(count, 1),
    )
    found = recordings(filmed(replace(still, static=moving)))
    _, told = found.told(*aside(3, 0.0), besides=3)
    assert off(told) < 0.03
    # Without the motion the frame of another time is off by pixels.
    monkeypatch.setattr(Recordings, "_shifts_m", lambda _, means, *__: torch.zeros_like(means))
    _, told = found.told(*aside(3, 0.0), besides=3)
    assert off(told) > 0.04


def test_the_nearest_frames_are_taken_and_none_that_is_withheld() -> None:
    found = recordings(filmed(street()))
    assert found.nearest(*aside(3, 0.2)) == [3, 2]
    assert found.nearest(*aside(3, 0.2), besides=3) == [2, 4]
    assert found.nearest(*aside(7, 0.0)) == [6, 5]


def test_an_untrained_network_keeps_a_view_that_no_frame_surely_shows() -> None:
    told = torch.rand(1, CHANNELS, 8, 8)
    told[:, [11, 15]] = 0
    with torch.inference_mode():
        kept = RestorerNetwork()(told)
    assert (kept - told[:, :3]).abs().max() < 0.015
    # 13 places of a sure frame have the weight of exp(-4) each beside the view's own pixel.
    flat = told.clone()
    flat[:, 8:11], flat[:, 11] = 0.5, 1
    with torch.inference_mode():
        mixed = RestorerNetwork()(flat)
    share = 13 * np.exp(-4) / (1 + 13 * np.exp(-4))
    expected = flat[:, :3] + share * (0.5 - flat[:, :3])
    torch.testing.assert_close(mixed, expected, atol=0.01, rtol=0)


def weights(folder: Path, copied: int) -> Path:
    """A network that copies every pixel from one of its places."""
    network = RestorerNetwork()
    assert network.answer.bias is not None
    with torch.no_grad():
        network.answer.bias[4 * copied : 4 * copied + 4] = 60
    path = folder / "restorer.safetensors"
    save_file({name: value.half() for name, value in network.state_dict().items()}, path)
    return path


def test_a_mended_view_is_copied_from_where_the_network_says(tmp_path: Path) -> None:
    scene = filmed(wall())
    found = recordings(scene)
    camera, t_s = aside(3, 1.0)
    seen, told = found.told(camera, t_s)
    assert scene.residual is not None
    evidence = evidence_of(scene, np.square(scene.residual.astype(np.float32)))
    # After the view's own pixel come nine around that of the first frame, whose middle is the fifth.
    restorer = Restorer.of(scene, evidence, weights(tmp_path, 1 + 4))
    torch.testing.assert_close(
        restorer.view(camera, t_s).colour.permute(2, 0, 1), torch.from_numpy(told[SAME]), atol=2e-3, rtol=0
    )
    odd = replace(camera, width_px=95, height_px=63)
    assert restorer.view(odd, t_s).colour.shape == (63, 95, 3)
    assert seen.colour.shape == (64, 96, 3)
    with pytest.raises(InputError, match="no such file"):
        load_restorer(tmp_path / "none.safetensors")


def test_a_scene_that_was_changed_has_no_frames() -> None:
    with pytest.raises(InputError, match="holds none"):
        recordings(street())


def test_a_kept_frame_is_the_frame_but_for_jpeg() -> None:
    picture = np.repeat(np.repeat(np.random.default_rng(0).integers(0, 255, (4, 6, 3)), 16, 0), 16, 1)
    picture = picture.astype(np.uint8)
    kept = kept_frame(picture)
    assert np.abs(frame_of(kept, (96, 64)).astype(int) - picture).mean() < 4
    assert kept_frame(picture) == kept
    for wrong, size in ((kept, (64, 96)), (kept[:200], (96, 64)), (b"", (96, 64))):
        with pytest.raises(InputError, match="recorded frame"):
            frame_of(wrong, size)


@given(height=st.integers(1, 6), width=st.integers(1, 20), seed=st.integers(0, 100))
def test_the_core_mixes_as_torch_does(height: int, width: int, seed: int) -> None:
    """Also where rows are shorter than what it takes at a time, and where logits are far apart."""
    generator = torch.Generator().manual_seed(seed)
    told = torch.rand(2, CHANNELS, 2 * height, 2 * width, generator=generator)
    network = RestorerNetwork((8, 8)).eval()
    with torch.no_grad():
        network.answer.weight.normal_(0, 3, generator=generator)
        network.answer.bias.normal_(0, 30, generator=generator)
        mixed = network(told)
    assert torch.allclose(mixed, network(told).detach(), atol=2e-5)
