"""From a layout and tiny random weights to a clip."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from dreamdrive.data.layout_file import read_layout, write_layout
from dreamdrive.errors import InputError
from dreamdrive.prior import choose_prior
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.control import Control
from dreamdrive.scene.street.layout import Layout
from streetworld import draw_street
from streetworld.drive import ego_poses
from tests.prior.magicdrive.tiny import SIZE, Written, write_folder

MAGICDRIVE = choose_prior("magicdrive")
MAGICDRIVE_T = choose_prior("magicdrive-t")


@pytest.fixture(scope="module")
def inputs(written: Written, tmp_path_factory: pytest.TempPathFactory) -> Control:
    """A layout, weights and the smallest run."""
    layout = tmp_path_factory.mktemp("layout") / "street.json"
    write_layout(draw_street(3), layout)
    return Control(layout, weights=written.path, frames="0:1", steps=1, fps=2.0)


@pytest.fixture(scope="module")
def once(inputs: Control) -> Clip:
    return MAGICDRIVE(inputs)


@pytest.fixture(scope="module")
def drive(inputs: Control) -> Clip:
    return MAGICDRIVE(replace(inputs, frames="0:5:2", hold_out=2))


def test_six_pictures_of_each_time_step(drive: Clip) -> None:
    assert len(drive) == 18
    assert drive.size == SIZE
    assert drive.camera.tolist() == [*range(6)] * 3
    np.testing.assert_allclose(drive.times_s, np.repeat([0.0, 1.0, 2.0], 6))
    assert drive.source_index.tolist() == np.repeat([0, 2, 4], 6).tolist()
    assert drive.held_out.tolist() == [False] * 6 + [True] * 6 + [False] * 6
    assert drive.valid.all()
    assert drive.features["appearance"].shape == (18, 12, 22, 15)
    assert drive.latents is not None
    assert drive.latents.shape == (18, 6, 11, 4)


def test_the_poses_are_those_of_the_path(drive: Clip, inputs: Control) -> None:
    """The front camera follows the layout's path as that of the street world does, without its shaking."""
    assert inputs.path is not None
    ego = read_layout(inputs.path).ego
    path = ego_poses(Layout(ego=type(ego)(track=ego.track)), np.array([0.0, 1.0, 2.0]))
    poses = drive.known.world_from_camera
    assert poses is not None
    np.testing.assert_allclose(poses[::6], np.linalg.inv(path[0]) @ path, atol=1e-9)
    assert (poses[0] == np.eye(4)).all()
    for index, pose in enumerate(poses):
        mounted = drive.rig[drive.camera[index]].world_from_camera
        np.testing.assert_allclose(pose, poses[index // 6 * 6] @ mounted, atol=1e-9)
    assert drive.requested is not None
    np.testing.assert_array_equal(drive.requested.world_from_camera, poses[::6])
    np.testing.assert_array_equal(drive.requested.times_s, [0.0, 1.0, 2.0])
    assert drive.known.intrinsics
    assert drive.known.generated
    assert "No motion can be seen" in drive.provenance["notes"][1]


def test_what_was_done_is_told(drive: Clip) -> None:
    about = drive.provenance
    assert about["prior"] == "magicdrive"
    assert about["cameras"][0] == "CAM_FRONT"
    assert (about["steps"], about["guidance"], about["rate_hz"]) == (1, 2.0, 2.0)
    assert about["prompt"].startswith("A driving scene image at boston-seaport. ")
    assert set(about["weights"]) == {"unet", "controlnet"}
    assert "changes from step to step" in about["notes"][1]


def test_a_time_step_is_sampled_by_itself(once: Clip, drive: Clip) -> None:
    np.testing.assert_array_equal(once.frames, drive.frames[:6])


def test_everything_asked_for_has_a_say(once: Clip, inputs: Control, tmp_path: Path) -> None:
    assert inputs.path is not None
    layout = read_layout(inputs.path)
    for name, changed in {
        "boxes": type(layout)(layout.ego, layout.areas, layout.lines),
        "lines": type(layout)(layout.ego, layout.areas, boxes=layout.boxes),
    }.items():
        write_layout(changed, tmp_path / f"{name}.json")
    controls = [replace(inputs, **change) for change in ({"seed": 1}, {"prompt": "Rain"}, {"steps": 2})]
    controls += [replace(inputs, path=tmp_path / f"{name}.json") for name in ("boxes", "lines")]
    assert once.latents is not None
    for control in controls:
        latents = MAGICDRIVE(control).latents
        assert latents is not None
        assert np.abs(latents - once.latents).max() > 1e-4


@pytest.mark.parametrize("where", ["sample", "denoised"])
def test_numbers_that_are_not_finite_are_refused(
    inputs: Control, monkeypatch: pytest.MonkeyPatch, where: str
) -> None:
    from dreamdrive.prior.magicdrive import sample

    right = getattr(sample, where)
    monkeypatch.setattr(sample, where, lambda *given, **more: right(*given, **more) * np.nan)
    with pytest.raises(InputError, match="gave latents that hold NaN"):
        MAGICDRIVE(inputs)


def test_a_gpu_that_is_too_small_is_a_message(inputs: Control, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*given: object, **more: object) -> None:
        raise torch.OutOfMemoryError("CUDA out of memory. Tried to allocate 2 GiB")

    monkeypatch.setattr("dreamdrive.prior.magicdrive.sample.sample", full)
    with pytest.raises(InputError, match=r"memory does not suffice .*take the weights for 400x224"):
        MAGICDRIVE(inputs)


def test_progress_counts_to_its_end(inputs: Control) -> None:
    told: list[tuple[int, int]] = []
    MAGICDRIVE(replace(inputs, frames="0:2"), lambda done, total: told.append((done, total)))
    assert told == [(done, 6) for done in range(1, 7)]


@pytest.mark.slow
def test_the_temporal_variant_samples_all_time_steps_together(inputs: Control, tmp_path: Path) -> None:
    weights = write_folder(tmp_path / "temporal", temporal=True).path
    control = replace(inputs, weights=weights, fps=None, frames="1:16:7")
    told: list[tuple[int, int]] = []
    clip = MAGICDRIVE_T(control, lambda done, total: told.append((done, total)))
    assert told[-1] == (5, 5)
    assert clip.source_index[::6].tolist() == [1, 8, 15]
    np.testing.assert_allclose(clip.times_s[::6], [0, 7 / 12, 14 / 12])
    assert "sampled together" in clip.provenance["notes"][1]
    assert clip.known.world_from_camera is None
    assert clip.known.generated
    assert clip.requested is not None
    np.testing.assert_allclose(clip.requested.times_s, [0, 7 / 12, 14 / 12])
    whole = MAGICDRIVE_T(replace(control, frames=None))
    assert len(whole) == 96
    np.testing.assert_array_equal(
        whole.frames.reshape(16, 6, 24, 44, 3)[1::7], clip.frames.reshape(3, 6, 24, 44, 3)
    )
    with pytest.raises(InputError, match="has only 16 frames"):
        MAGICDRIVE_T(replace(control, frames="0:17"))
    with pytest.raises(InputError, match="takes no --fps"):
        MAGICDRIVE_T(replace(control, fps=10.0))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"path": None}, "needs a layout"),
        ({"weights": None}, "magicdrive needs --weights"),
        ({"weights": Path("nowhere")}, "nowhere is no folder; expected a folder with unet/"),
        ({"steps": 0}, "--steps 0: expected 1 or more"),
        ({"steps": 1001}, "--steps 1001: expected at most 1000"),
        ({"fps": 0.0}, "--fps 0: expected more than 0"),
        ({"hold_out": 9}, "withholds nothing of 1 frames"),
        ({"size": (400, 224)}, "takes no --size"),
    ],
)
def test_what_it_cannot_use_is_refused(inputs: Control, change: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        MAGICDRIVE(replace(inputs, **change))  # pyright: ignore[reportArgumentType]


def test_a_layout_without_a_road_is_refused(inputs: Control, tmp_path: Path) -> None:
    layout = draw_street(3)
    write_layout(type(layout)(layout.ego), tmp_path / "bare.json")
    with pytest.raises(InputError, match=r"bare\.json: no area is of kind road"):
        MAGICDRIVE(replace(inputs, path=tmp_path / "bare.json"))


def test_a_missing_package_is_named(inputs: Control, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [name for name in sys.modules if name.startswith("dreamdrive.prior.magicdrive.")]:
        if name.rsplit(".", 1)[1] in ("folder", "sample"):
            monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "transformers", None)
    with pytest.raises(InputError, match=r"cannot start .*transformers.*video-prior"):
        MAGICDRIVE(inputs)
