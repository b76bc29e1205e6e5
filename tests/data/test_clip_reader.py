import json
import resource

import cv2
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from dreamdrive.data import SourceLens, clip_reader, read_clip
from dreamdrive.data.input import read_dataset
from dreamdrive.data.pictures import sampler
from dreamdrive.errors import InputError
from dreamdrive.scene.control import Control
from tests.data.textures import texture

CALIBRATION = {"width": 64, "height": 48, "intrinsics": {"fx": 60.0, "fy": 60.0, "cx": 31.5, "cy": 23.5}}


def calibration(tmp_path, **more):
    path = tmp_path / "calibration.json"
    path.write_text(json.dumps({**CALIBRATION, **more}))
    return path


def test_a_folder_becomes_a_clip(make_folder):
    clip = read_clip(make_folder(10), fps=5.0, frames="2:9:3", hold_out=2)
    assert clip.source_index.tolist() == [2, 5, 8]
    assert clip.times_s.tolist() == pytest.approx([0, 0.6, 1.2])
    assert clip.held_out.tolist() == [False, True, False]
    assert clip.size == (64, 48)
    assert clip.valid.all()
    np.testing.assert_array_equal(clip.frames[1], texture(48, 64, 5))
    assert clip.recorded is not None
    assert clip.recorded.lens is None
    assert not clip.known.intrinsics
    assert clip.known.world_from_camera is None
    assert json.loads(json.dumps(clip.provenance)) == clip.provenance


def test_a_folder_without_a_rate_counts_as_10_hz_and_says_so(make_folder):
    clip = read_clip(make_folder(4), frames="0:4:3")
    assert clip.times_s.tolist() == pytest.approx([0, 0.3])
    assert any("10 Hz" in note for note in clip.provenance["notes"])


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=10)
@given(st.integers(0, 5), st.integers(1, 4), st.floats(1, 60))
def test_times_follow_the_rate_of_the_input(make_video, start, step, fps):
    clip = read_clip(make_video(12), frames=f"{start}::{step}", fps=fps)
    np.testing.assert_array_equal(clip.source_index, np.arange(start, 12, step))
    np.testing.assert_allclose(clip.times_s, (clip.source_index - start) / fps)


def test_a_video_has_its_own_times(make_video):
    clip = read_clip(make_video(12, rate=20), frames="4:12:2")
    assert clip.times_s.tolist() == pytest.approx([0, 0.1, 0.2, 0.3])
    assert clip.recorded is not None
    assert clip.recorded.is_video


def test_negative_indices_count_from_the_end_of_a_video(make_video):
    assert read_clip(make_video(12), frames="-4:-1").source_index.tolist() == [8, 9, 10]


@pytest.mark.parametrize("size", [(48, 64), (65, 49), (33, 97), (640, 360), (641, 361), (17, 16)])
def test_portrait_odd_and_small_frames(make_folder, size):
    clip = read_clip(make_folder(2, size=size))
    assert clip.size[0] == min(480, size[0] - size[0] % 2)
    assert clip.size[1] % 2 == 0
    assert (clip.rig[0].width_px, clip.rig[0].height_px) == clip.size


def test_an_8000_pixel_image_costs_no_more_than_itself(make_folder):
    image = cv2.resize(texture(60, 80), (8000, 6000), interpolation=cv2.INTER_LINEAR)
    folder = make_folder([image, image], suffix=".jpg")
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    clip = read_clip(folder)
    assert clip.size == (480, 360)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 6 * image.nbytes / 1024


def test_16_bit_grey_and_alpha_folders(make_folder):
    image = texture(48, 64)
    alpha = np.full((48, 64), 255, dtype=np.uint8)
    alpha[:, :8] = 0
    deep = read_clip(make_folder([image.astype(np.uint16) * 257] * 2, name="deep"))
    np.testing.assert_array_equal(deep.frames[0], image)
    grey = read_clip(make_folder([image[..., 0]] * 2, name="grey"))
    np.testing.assert_array_equal(grey.frames[0, ..., 1], image[..., 0])
    clear = read_clip(make_folder([np.dstack([image, alpha])] * 2, name="clear"))
    np.testing.assert_array_equal(clear.valid[0], alpha > 0)
    assert (clear.frames[~clear.valid] == 0).all()
    for clip, word in ((deep, "16-bit"), (grey, "grey"), (clear, "Transparent")):
        assert any(word in note for note in clip.provenance["notes"])


def test_a_transparent_edge_spoils_every_pixel_it_touches(make_folder):
    alpha = np.full((96, 1000), 255, dtype=np.uint8)
    alpha[:, :251] = 0
    image = np.dstack([np.full((96, 1000, 3), 200, dtype=np.uint8), alpha])
    image[alpha == 0] = 0
    clip = read_clip(make_folder([image] * 2), size=(500, 48))
    assert not clip.valid[0, :, :126].any()
    assert clip.valid[0, :, 126:].all()
    assert (clip.frames[clip.valid] == 200).all()


def test_a_calibrated_clip_is_undistorted_once(make_folder, tmp_path):
    distortion = {"model": "opencv", "coefficients": [0.4, 0, 0, 0]}
    clip = read_clip(make_folder(2), intrinsics=calibration(tmp_path, distortion=distortion))
    assert clip.known.intrinsics
    assert (clip.rig[0].fx_px, clip.rig[0].cx_px, clip.rig[0].cy_px) == (60, 32, 24)
    assert not clip.valid[0, 0, 0]
    assert clip.valid[0, 24, 32]
    lens = SourceLens.from_json(clip.recorded.lens)
    assert lens.camera.matrix.tolist() == clip.rig[0].matrix.tolist()
    again = lens.apply(clip.frames[0] / 255.0)
    error = np.abs(again - texture(48, 64) / 255.0)[4:-4, 4:-4]
    assert error.mean() < 0.02


def test_known_poses_start_at_the_first_selected_frame(make_folder, tmp_path):
    poses = np.tile(np.eye(4), (6, 1, 1))
    poses[:, 2, 3] = np.arange(6) + 3
    rows = "\n".join(" ".join(map(str, p[:3].ravel())) for p in poses)
    (tmp_path / "poses.txt").write_text(rows)
    clip = read_clip(make_folder(6), frames="1:6:2", poses=tmp_path / "poses.txt")
    assert clip.known.world_from_camera is not None
    assert clip.known.world_from_camera[:, 2, 3].tolist() == [0, 2, 4]


def test_one_pose_per_frame_of_a_video(make_video, tmp_path):
    poses = np.tile(np.eye(4), (12, 1, 1))
    poses[:, 0, 3] = np.arange(12)
    rows = "\n".join(" ".join(map(str, p[:3].ravel())) for p in poses)
    (tmp_path / "poses.txt").write_text(rows)
    clip = read_clip(make_video(12), frames="3:9:2", poses=tmp_path / "poses.txt")
    assert clip.known.world_from_camera is not None
    assert clip.known.world_from_camera[:, 0, 3].tolist() == [0, 2, 4]


def test_a_missing_input_is_refused(tmp_path):
    with pytest.raises(InputError, match="none does not exist; expected a video or a folder"):
        read_clip(tmp_path / "none")


def test_one_frame_names_the_priors_that_will_take_it(make_folder, make_video):
    folder = make_folder(3)
    for path, frames in ((folder / "0.png", None), (folder, "1:2"), (make_video(5), "2:3")):
        with pytest.raises(InputError, match=r"single frame.* vista, svd, cosmos and diffusers"):
            read_clip(path, frames=frames)


def test_a_layout_is_no_recording(tmp_path):
    (tmp_path / "layout.json").write_text("{}")
    with pytest.raises(InputError, match="--prior street-world"):
        read_clip(tmp_path / "layout.json")


def test_frames_of_different_sizes_name_the_first_two(make_folder):
    images = [texture(48, 64), texture(48, 64), texture(50, 64), texture(99, 99)]
    with pytest.raises(InputError, match=r"0\.png is 64x48 but 2\.png is 64x50"):
        read_clip(make_folder(images))


def test_an_unreadable_image_is_named(make_folder):
    folder = make_folder(4)
    (folder / "2.png").write_bytes(b"rubbish")
    with pytest.raises(InputError, match=r"2\.png cannot be read as an image"):
        read_clip(folder)
    assert len(read_clip(folder, frames="0:2")) == 2


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"fps": 0.0}, "--fps 0: expected a positive"),
        ({"fps": float("nan")}, "--fps nan"),
        ({"frames": "0:9"}, "asks for frame 8, but .* only 6 frames"),
        ({"frames": "6:"}, "selects no frame"),
        ({"frames": "x"}, "expected START:STOP"),
        ({"size": (64, 64)}, "nearest sizes are 64x48 and 86x64"),
        ({"hold_out": 1}, "--hold-out 1"),
        ({"hfov_deg": 0.0}, "--hfov 0"),
    ],
)
def test_bad_options_are_refused(make_folder, options, words):
    with pytest.raises(InputError, match=words):
        read_clip(make_folder(6), **options)


def test_two_focal_lengths_are_one_too_many(make_folder, tmp_path):
    with pytest.raises(InputError, match="give one of them"):
        read_clip(make_folder(2), intrinsics=calibration(tmp_path), hfov_deg=60.0)


def test_intrinsics_for_another_shape_are_refused(make_folder, tmp_path):
    with pytest.raises(InputError, match="is for 64x48 images, but the input is 64x36"):
        read_clip(make_folder(2, size=(64, 36)), intrinsics=calibration(tmp_path))


def test_a_clip_without_any_picture_is_refused(make_folder):
    image = np.dstack([texture(48, 64), np.zeros((48, 64), dtype=np.uint8)])
    with pytest.raises(InputError, match="nothing is left"):
        read_clip(make_folder([image] * 2))


def test_more_frames_than_memory_holds_are_refused(make_folder, monkeypatch):
    monkeypatch.setattr(sampler, "MAX_FRAMES", 4)
    folder = make_folder(6)
    with pytest.raises(InputError, match="more than 4 frames of 64x48 are selected"):
        read_clip(folder)
    assert len(read_clip(folder, frames="0:4")) == 4


@pytest.mark.parametrize("count", [5, 8, 9, 16])
def test_of_too_many_frames_every_nth_is_taken(make_folder, make_video, monkeypatch, count):
    """A video, which does not tell how many frames it has, as a folder, which does."""
    monkeypatch.setattr(clip_reader, "MAX_FRAMES", 4)
    for made in (make_folder(count), make_video(count)):
        clip = read_clip(made, fps=10.0)
        step = 2 if count <= 8 else 4
        assert clip.source_index.tolist() == list(range(0, count, step))
        np.testing.assert_allclose(clip.times_s, np.arange(0, count, step) / 10)
        which = {2: "second", 4: "4th"}[step]
        assert f"every {which} one is taken" in " ".join(clip.provenance["notes"])
        np.testing.assert_array_equal(
            clip.frames, read_clip(made, frames=f"0:{count}:{step}", fps=10.0).frames
        )
        assert len(read_clip(made, frames=f"0:{count}")) == count


def test_a_recording_is_read_by_what_a_control_holds(make_folder):
    control = Control(path=make_folder(3), fps=5.0)
    assert len(read_dataset(control)) == 3


def test_frames_too_far_apart_are_not_taken(make_folder, make_video, monkeypatch):
    monkeypatch.setattr(clip_reader, "MAX_FRAMES", 4)
    monkeypatch.setattr(sampler, "MAX_FRAMES", 4)
    for made in (make_folder(17), make_video(17)):
        with pytest.raises(InputError, match="more than 4 frames of 64x48 are selected, too many"):
            read_clip(made, fps=10.0)


def test_enlarging_is_said(make_folder):
    clip = read_clip(make_folder(2), size=(128, 96))
    assert clip.size == (128, 96)
    assert any("enlarged 2.00 times" in note for note in clip.provenance["notes"])


def test_golden_a_real_clip_is_area_averaged_exactly(data_dir):
    folder = data_dir / "clips/pandaset_002/front_camera"
    clip = read_clip(folder, fps=10.0, frames="20:24:2", size=(480, 270))
    image = cv2.imread(str(sorted(folder.iterdir())[22]), cv2.IMREAD_COLOR)[..., ::-1]
    np.testing.assert_array_equal(clip.frames[1], cv2.resize(image, (480, 270), interpolation=cv2.INTER_AREA))


def test_golden_a_distorted_video_survives_there_and_back(data_dir):
    clips = data_dir / "clips/udacity_highway_two_cars"
    options = {"frames": "0:4:2", "size": (480, 270)}
    plain = read_clip(clips / "video.mp4", **options)
    clip = read_clip(clips / "video.mp4", **options, intrinsics=clips / "meta.json")
    lens = SourceLens.from_json(clip.recorded.lens)
    again = lens.apply(clip.frames[0] / 255.0)
    seen = lens.covered()
    error = (again - plain.frames[0] / 255.0)[seen]
    assert seen.mean() > 0.85
    assert -10 * np.log10(np.mean(error**2)) > 35


def test_a_clock_of_no_camera_asks_for_a_rate(make_video):
    path = make_video(6, rate=1_000_000)
    with pytest.raises(InputError) as caught:
        read_clip(path)
    assert str(caught.value) == f"{path} has no usable times; give its rate with --fps"
    np.testing.assert_allclose(read_clip(path, fps=10).times_s, np.arange(6) / 10)


def test_black_frames_are_refused(make_folder):
    noise = np.abs(np.random.default_rng(0).normal(0, 3, (4, 48, 64, 3)))
    folder = make_folder(list(noise.astype(np.uint8)))
    with pytest.raises(InputError) as refused:
        read_clip(folder, fps=10)
    assert str(refused.value) == (
        f"{folder}: every selected frame is black; expected pictures of a street, choose others with --frames"
    )


def test_frames_of_one_colour_are_said_to_show_nothing(make_folder):
    clip = read_clip(make_folder([np.full((48, 64, 3), 120, np.uint8)] * 3), fps=10)
    assert "No frame shows anything that could be recognised." in clip.provenance["notes"]
