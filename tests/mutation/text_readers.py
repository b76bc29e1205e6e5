"""What users bring: calibration, poses, rigs, layouts, COLMAP, transforms.json, truth, configurations."""

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pycolmap

from dreamdrive.cli.terminal.arguments import EXAMPLES, parse_action
from dreamdrive.data.cameras.intrinsics import read_intrinsics
from dreamdrive.data.cameras.poses import (
    of_frames,
    read_pose_file,
    read_trajectories,
    read_trajectory,
    write_trajectory,
)
from dreamdrive.data.companions import frames_among
from dreamdrive.data.frames.name_times import times_of_names
from dreamdrive.data.layout_file import read_layout, write_layout
from dreamdrive.data.pictures.images import SUFFIXES
from dreamdrive.data.rig import read_rig, write_rig
from dreamdrive.errors import InputError
from dreamdrive.evaluate.truth.geometry import read_geometry_truth
from dreamdrive.files.json_file import read_json
from dreamdrive.files.paths import read_text
from dreamdrive.geometry.backends.dust3r.network.config import config_from_call, config_from_json
from dreamdrive.geometry.backends.files import attach, bent_model
from dreamdrive.geometry.backends.files.formats import companions
from dreamdrive.options import QUALITIES
from dreamdrive.prior.magicdrive.config import read_settings
from dreamdrive.run.options_file import read_options
from dreamdrive.run.report.outcome import lines_of, read_outcome
from dreamdrive.scene.camera import FARTHEST_M
from dreamdrive.scene.control import check_action
from dreamdrive.scene.trajectory import Trajectory
from dreamdrive.tasks.plan import read_results
from tests.evaluate.truth.test_geometry import asking, pandaset, recording
from tests.geometry.backends.dust3r.network.test_config import CALL, HUB
from tests.geometry.backends.files import drives
from tests.mutation.reader import Reader
from tests.prior.magicdrive.tiny import official_configs
from tests.streets import small_street
from tests.tasks.plan.recorded.test_results import PLANS, as_json, as_pickle, as_table

_NAMES = [f"{i:04d}.jpg" for i in range(4)]
_TRUTH = np.array([drives.pose((0, 0.02 * i, 0), (0.1 * i, 0, 1.0 * i)) for i in range(4)])
_TIMES_S = 0.1 * np.arange(4)
_META = {
    "width": 160,
    "height": 96,
    "intrinsics": {"fx": 130.0, "fy": 125.0, "cx": 77.0, "cy": 50.0},
    "distortion": {"model": "opencv k1 k2 p1 p2 k3", "coefficients": [0.1, 0.01, 0, 0, 0]},
}
_KITTI = "\n".join(" ".join(map(repr, pose[:3].ravel().tolist())) for pose in _TRUTH) + "\n"


def _json(name: str, content: object) -> Callable[[Path], object]:
    return lambda folder: (folder / name).write_text(json.dumps(content))


def _poses(path: Path, camera: str | None = None) -> None:
    rows = read_pose_file(path, "--poses", camera)
    assert np.isfinite(rows.world_from_camera).all()
    assert np.abs(rows.world_from_camera[:, :3, 3]).max() <= FARTHEST_M
    of_frames(rows, np.array([0, 2]), np.array([0.0, 0.2]), lambda: 4)


def _attached(folder: Path) -> None:
    """Everything that is asked of geometry files."""
    clip = drives.make_clip(folder / "clip", [1, 3], 4)
    companions(folder / "model")
    bent_model(folder / "model")
    known = attach(clip, folder / "model").known
    assert known.world_from_camera is not None
    assert np.isfinite(known.world_from_camera).all()
    assert np.abs(known.world_from_camera[:, :3, 3]).max() <= 2 * FARTHEST_M
    assert known.depth_m is None or np.isfinite(known.depth_m).all()


def _depth(folder: Path) -> None:
    (folder / "depth").mkdir(parents=True)
    for name in _NAMES:
        np.savez(folder / "depth" / f"{name[:4]}.npz", depth_m=np.full((12, 20), 5.0))


def _plain(folder: Path) -> None:
    content = {**_META, "world_from_camera": _TRUTH.tolist(), "frames": [0, 1, 2, 3]}
    drives.write_json(folder / "model" / "cameras.json", content)
    drives.write_json(folder / "model" / "geometry.json", {"metric": True, "depth_unit": "m"})
    _depth(folder / "model")


def _transforms(folder: Path) -> None:
    _depth(folder / "model")
    made = drives.transforms(_TRUTH, _NAMES, depth_unit_scale_factor=0.5)
    for frame in made["frames"]:
        frame["depth_file_path"] = f"depth/{frame['file_path'][:4]}.npz"
    drives.write_json(folder / "model" / "transforms.json", made)


def _bent_transforms(path: Path) -> None:
    drives.write_json(path, drives.transforms(_TRUTH, _NAMES, camera_model="OPENCV", k1=0.1, p1=0.01))


_PANDASET = {
    "cameras": {
        "clip": {
            "width": 160,
            "height": 96,
            "K": [[130.0, 0, 77], [0, 125.0, 50], [0, 0, 1]],
            "camera_to_world": _TRUTH.tolist(),
            "frames": [0, 1, 2, 3],
        }
    }
}


def _kitti(folder: Path) -> None:
    (folder / "model").mkdir()
    (folder / "model" / "poses.txt").write_text(_KITTI)
    rows = [f"P{i}: 130 0 77 {-5.0 * i} 0 125 50 0 0 0 1 0" for i in range(4)]
    (folder / "model" / "calib.txt").write_text("\n".join(rows) + "\n")
    drives.write_json(folder / "model" / "geometry.json", {"camera": "P2"})


def _tum(path: Path) -> None:
    path.parent.mkdir(exist_ok=True)
    write_trajectory(Trajectory(_TRUTH, _TIMES_S), path)


def _colmap_text(folder: Path) -> Path:
    return drives.write_colmap_text(folder, _TRUTH, _NAMES, points=np.arange(9.0).reshape(3, 3))


def _colmap_binary(folder: Path) -> None:
    text = _colmap_text(folder)
    pycolmap.Reconstruction(str(text)).write_binary(str(folder))
    for path in folder.glob("*.txt"):
        path.unlink()


def _rig(folder: Path) -> None:
    write_rig({"front": np.eye(4), "left": _TRUTH[1]}, folder, "intrinsics.json")


def _layout(folder: Path) -> None:
    write_layout(small_street(frames=3, size=(24, 16), parked=1).layout, folder / "layout.json")


def _magicdrive(folder: Path) -> None:
    for name, content in zip(("unet", "controlnet"), official_configs(temporal=True), strict=True):
        drives.write_json(folder / f"{name}.json", content)


def _action(folder: Path) -> None:
    for line in read_text(folder / "actions.txt").split("\n"):
        check_action(parse_action(line))


_LISTED = [f"1557539924.{k}49981.png" for k in range(3)] + [
    "1557539924.049981_mask.png",
    "a_1.jpg",
    "b_1.jpg",
]
_REPORT = {
    "frames": {"count": 24, "size": [320, 180]},
    "gaussians": {"static": 7, "dynamic": 2},
    "stages": {"fit": {"seconds": 12.5}},
    "actors": [{}],
    "held_out": {"3": {}},
    "held_out_mean": {"psnr": 25.0},
    "baselines": {"flow_interpolation": {"mean": {"psnr": 20.0}}},
    "rough": ["there are only 3 frames"],
    "limits": ["from the height of the camera"],
}


def _options(folder: Path) -> None:
    text = 'representation = "static"\n\n[fit]\nsteps = 600\n\n[geometry]\ncamera_height_m = 1.5\n'
    (folder / "o.toml").write_text(text)


def _names(folder: Path) -> None:
    (folder / "names.txt").write_text("\n".join(_LISTED))


def _read_names(folder: Path) -> None:
    names = [Path(line) for line in read_text(folder / "names.txt").split("\n")]
    files = [name for name in names if name.suffix.lower() in SUFFIXES]
    if files:
        frames_among(files)
    times_s = times_of_names(files)
    assert times_s is None or (np.diff(times_s) >= 0).all()


def _trajectories(folder: Path) -> None:
    one = {"world_from_camera": _TRUTH.tolist(), "times_s": _TIMES_S.tolist()}
    (folder / "t.json").write_text(json.dumps([one, one]))


def _read_report(folder: Path) -> None:
    lines_of(read_outcome(folder / "report.json", already_finished=True))


TEXT: tuple[Reader, ...] = (
    Reader("intrinsics", _json("c.json", _META), lambda f: read_intrinsics(f / "c.json", (160, 96))),
    Reader(
        "intrinsics-transforms",
        lambda f: _bent_transforms(f / "transforms.json"),
        lambda f: read_intrinsics(f, (160, 96)),
    ),
    Reader(
        "intrinsics-colmap",
        lambda f: drives.write_colmap_text(f, _TRUTH, _NAMES, "OPENCV", [130, 125, 77, 50, 0.1, 0, 0, 0.01]),
        lambda f: read_intrinsics(f, (160, 96)),
    ),
    Reader("intrinsics-binary", _colmap_binary, lambda f: read_intrinsics(f, (160, 96))),
    Reader(
        "poses-json",
        _json("p.json", {"world_from_camera": _TRUTH.tolist(), "times_s": _TIMES_S.tolist()}),
        lambda f: (_poses(f / "p.json"), read_trajectory(f / "p.json")),
    ),
    Reader(
        "poses-tum",
        lambda f: _tum(f / "p.txt"),
        lambda f: (_poses(f / "p.txt"), read_trajectory(f / "p.txt")),
    ),
    Reader("poses-kitti", lambda f: (f / "p.txt").write_text(_KITTI), lambda f: _poses(f / "p.txt")),
    Reader("poses-pandaset", _json("p.json", _PANDASET), lambda f: _poses(f / "p.json", "clip")),
    Reader("rig", _rig, read_rig),
    Reader("layout", _layout, lambda f: read_layout(f / "layout.json")),
    Reader("files-plain", _plain, _attached),
    Reader("files-transforms", _transforms, _attached),
    Reader("files-pandaset", lambda f: drives.write_json(f / "model" / "cameras.json", _PANDASET), _attached),
    Reader("files-kitti", _kitti, _attached),
    Reader("files-tum", lambda f: _tum(f / "model" / "poses.txt"), _attached),
    Reader("files-colmap", lambda f: _colmap_text(f / "model"), _attached),
    Reader("files-binary", lambda f: _colmap_binary(f / "model"), _attached),
    Reader(
        "truth-pandaset",
        pandaset,
        lambda f: read_geometry_truth(f, asking([0, 1, 2], (64, 32), "side_camera")),
    ),
    Reader("truth-kitti", recording, lambda f: read_geometry_truth(f, asking([0, 1, 2], (64, 32)))),
    *(
        Reader(f"plans-{name}", partial(write, plans=PLANS), lambda f, file=file: read_results(f / file))
        for name, write, file in (
            ("json", as_json, "plans.json"),
            ("pickle", as_pickle, "plans.pkl"),
            ("table", as_table, "table.npz"),
        )
    ),
    Reader("options", _options, lambda f: read_options(f / "o.toml", QUALITIES["draft"])),
    Reader(
        "names", lambda f: (f / "names.txt").write_text("\n".join(_LISTED)), _read_names, names_file=False
    ),
    Reader("trajectories", _trajectories, lambda f: read_trajectories(f / "t.json")),
    Reader("report", _json("report.json", _REPORT), _read_report),
    Reader(
        "dust3r-json",
        _json("config.json", HUB),
        lambda f: config_from_json(read_text(f / "config.json"), str(f / "config.json")),
    ),
    Reader(
        "dust3r-call",
        lambda f: (f / "call.txt").write_text(CALL),
        lambda f: config_from_call(read_text(f / "call.txt"), str(f / "call.txt")),
    ),
    Reader(
        "magicdrive-config",
        _magicdrive,
        lambda f: read_settings(read_json(f / "unet.json"), read_json(f / "controlnet.json")),
        names_file=False,
    ),
    Reader(
        "action",
        lambda f: (f / "actions.txt").write_text("\n".join(EXAMPLES)),
        _action,
        (InputError,),
        names_file=False,
    ),
)
