"""A scene folder whose checksums are right and whose content is not."""

import hashlib
import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import torch
from safetensors.torch import load_file, save

from dreamdrive.errors import InputError
from dreamdrive.splat import render_scene
from dreamdrive.stored import load_scene, save_scene
from tests.scene.scenes import make_baseline, make_scene

Index = dict[str, Any]


def stored(path: Path) -> Path:
    save_scene(make_scene(), path / "s")
    return path / "s"


def change(folder: Path, how: Callable[[Index], object]) -> None:
    """Change the index and put its checksum right."""
    index = json.loads((folder / "scene.json").read_text())
    del index["sha256"]
    how(index)
    text = json.dumps(index, sort_keys=True)
    (folder / "scene.json").write_text(
        json.dumps({**index, "sha256": hashlib.sha256(text.encode()).hexdigest()})
    )


def change_part(folder: Path, name: str, how: Callable[[dict[str, torch.Tensor]], object]) -> None:
    """Change the tensors of a part and put all checksums right."""
    tensors = load_file(folder / f"main-{name}.safetensors")
    how(tensors)
    data = save(tensors)
    (folder / f"main-{name}.safetensors").write_bytes(data)
    digest = hashlib.sha256(data).hexdigest()
    change(folder, lambda index: index["parts"].update({f"main-{name}.safetensors": digest}))


def put(index: Index, path: str, value: object) -> None:
    *way, last = path.split(".")
    for step in way:
        index = index[int(step) if step.isdigit() else step]
    index[int(last) if last.isdigit() else last] = value


WRONG = {
    "parts": [
        {},
        [],
        None,
        {"../../secret": "0" * 64},
        {"main-static.safetensors": 5},
        {"/etc/passwd": "0" * 64},
    ],
    "cameras": [[], None, {}, [1], [{}]],
    "cameras.0.fx_px": [0, -1, 1e300, None, "x", [1]],
    "cameras.0.width_px": [0, -5, 10**7, 10**9, 1.5, True, None],
    "cameras.0.world_from_camera": [[], [[1]], None, [[0] * 4] * 4, [[1e300] * 4] * 4],
    "times_s": [[], [0.0], None, "x", [1.0, 0.5, 0.0], [0.0, 0.0, 0.0], [0.0, 0.1, 1e300]],
    "held_out": [[True], None, [1, 0, 1]],
    "camera": [[0, 0], [0, 1, 10**9], "x"],
    "actors.0.positions_m": [[], [[1e300, 0, 0]], [[1, 2]], None],
    "actors.0.times_s": [[], None, [3.0, 2.0, 1.0]],
    "actors.0.count": [-1, 10**12, "x"],
    "actors.0.times_s.1": [1e300],
    "actors.0.yaw_rad": [[0.0], [1e300, 0.0]],
    "actors.0.spread_m": [[1.0], [-1.0, 1.0]],
    "actors.0.size_m": [[0, 1, 1], [1, 1], [-1, 1, 1]],
    "actors.0.ahead": [[0, 0, 2], [0, 0], [1e300, 0, 0]],
    "deformation.width": [10**7, 0, -1, None, 1e300, "x"],
    "deformation.depth": [10**7, 0, 10**3],
    "deformation.track_times": [10**7, 0, -1],
    "deformation.actors": [10**7, -1],
    "deformation.position_frequencies": [10**7, -1],
    "sky": [None, {}, {"azimuth_rad": [0], "elevation_rad": [0, 1]}],
    "sky.azimuth_rad": [[1, 0], [0, 1, 2], None, [0, 1e300]],
    "provenance.camera_height_m": [1e300, "x"],
    "provenance.log": [
        {"name": "a", "log_from_world": rows, "start_s": 0.0}
        for rows in ([], [[1.0]], [[0.0] * 4] * 4, [[1e300] * 4] * 4, "x")
    ],
    "provenance": [None, [], {"up": [0, 0, 0]}, {"up": "x"}, {"source_index": [1]}, {"lens": 3}],
}


@pytest.mark.parametrize(
    ("where", "value"), [(where, value) for where, all_ in WRONG.items() for value in all_]
)
def test_wrong_values_are_refused(tmp_path: Path, where: str, value: object) -> None:
    folder = stored(tmp_path)
    change(folder, lambda index: put(index, where, value))
    with pytest.raises(InputError):
        load_scene(folder)


def test_names_are_those_of_the_folder(tmp_path: Path) -> None:
    folder = stored(tmp_path)
    secret = (tmp_path / "secret").write_bytes(b"mine")
    assert secret
    digest = hashlib.sha256(b"mine").hexdigest()
    change(folder, lambda index: index["parts"].update({"../secret": digest}))
    with pytest.raises(InputError, match=r"names '\.\./secret', which is not a plain name of a file in it"):
        load_scene(folder)


@pytest.mark.parametrize("kind", ["pipe", "zero", "link", "folder"])
@pytest.mark.parametrize("name", ["scene.json", "main-static.safetensors"])
def test_only_regular_files_are_read(tmp_path: Path, kind: str, name: str) -> None:
    folder = stored(tmp_path)
    (folder / name).rename(tmp_path / "kept")
    if kind == "pipe":
        os.mkfifo(folder / name)
    elif kind == "folder":
        (folder / name).mkdir()
    else:
        (folder / name).symlink_to("/dev/zero" if kind == "zero" else tmp_path / "kept")
    reason = (
        "it is not a regular file" if kind in ("pipe", "folder") else "it is a link|is a link; dreamdrive"
    )
    with pytest.raises(InputError, match=reason):
        load_scene(folder)


CHANGED: dict[str, tuple[str, Callable[[dict[str, torch.Tensor]], object], str]] = {
    "NaN means": ("static", lambda t: t["means"].fill_(torch.nan), "means holds NaN or infinite numbers"),
    "far means": ("static", lambda t: t["means"].fill_(1e30), "Gaussians lie more than 1e"),
    "infinite scales": ("dynamic", lambda t: t["log_scales"].fill_(torch.inf), "log_scales holds NaN"),
    "no rotation": ("static", lambda t: t["quaternions"][2].zero_(), "quaternions of length 0"),
    "long rotation": ("dynamic", lambda t: t["quaternions"].mul_(1e12), "quaternions of length 0, or of no"),
    "NaN rotation": ("static", lambda t: t["quaternions"].fill_(torch.nan), "quaternions holds NaN"),
    "giants": ("static", lambda t: t["log_scales"][1].fill_(100.0), r"larger than exp\(40\) m"),
    "glaring": ("dynamic", lambda t: t["sh"].fill_(1e30), "coefficients of colour beyond"),
    "negative life": ("dynamic", lambda t: t["lifespan"].neg_(), "life spans below 0"),
    "late life": ("dynamic", lambda t: t["lifespan"].fill_(1e30), "at no time that recordings have"),
    "bright sky": ("sky", lambda t: t["texture"].fill_(1e30), "brighter or wider than skies are"),
    "empty sky": ("sky", lambda t: t.update(texture=torch.zeros(0, 4, 3)), r"the sky has \(0, 4, 3\) texels"),
    "bright exposure": ("exposure", lambda t: t["transforms"].fill_(1e30), "changes colours by more"),
    "no exposure": (
        "exposure",
        lambda t: t.update(camera=torch.ones(2, dtype=torch.int64)),
        "does not tell of all cameras",
    ),
    "other type": ("static", lambda t: t.update(means=t["means"].double().int()), "Gaussians.means"),
    "short source": ("static", lambda t: t.update(source_frame=t["source_frame"][:1]), "source_frame"),
    "source beyond": ("static", lambda t: t["source_frame"].fill_(99), "frames beyond the"),
    "actor beyond": ("dynamic", lambda t: t["actor"].fill_(9), "actors beyond the"),
    "missing": ("static", lambda t: t.pop("means"), "means"),
    "unknown": ("static", lambda t: t.update(more=t["means"].clone()), "Gaussians has no field 'more'"),
    "harmonics": ("static", lambda t: t.update(sh=t["sh"][:, :, :2].contiguous()), "Gaussians.sh"),
    "sky": ("sky", lambda t: t.update(texture=t["texture"][0]), "Sky.texture"),
    "exposure": (
        "exposure",
        lambda t: t.update(transforms=t["transforms"][:, :2].contiguous()),
        "transforms",
    ),
    "network": ("deformation", lambda t: t.pop("head_mean.weight"), "head_mean.weight"),
    "network type": (
        "deformation",
        lambda t: t.update({"head_mean.weight": t["head_mean.weight"].half()}),
        "float16",
    ),
    "network shape": (
        "deformation",
        lambda t: t.update({"head_mean.bias": torch.zeros(9)}),
        "head_mean.bias",
    ),
}


@pytest.mark.parametrize("name", CHANGED)
def test_wrong_tensors_are_refused(tmp_path: Path, name: str) -> None:
    part, how, said = CHANGED[name]
    folder = stored(tmp_path)
    change_part(folder, part, how)
    with pytest.raises(InputError, match=said):
        load_scene(folder)


def test_speeds_are_bounded(tmp_path: Path) -> None:
    save_scene(make_baseline("vibration"), tmp_path / "s")
    change_part(tmp_path / "s", "dynamic", lambda t: t["velocity"].fill_(1e9))
    with pytest.raises(InputError, match=r"faster than 1e\+07 m/s"):
        load_scene(tmp_path / "s")


def test_two_actors_of_one_id_are_refused(tmp_path: Path) -> None:
    folder = stored(tmp_path)
    change(folder, lambda index: index["actors"].append(dict(index["actors"][0])))
    with pytest.raises(InputError, match="two actors have one id"):
        load_scene(folder)


def test_a_motion_that_leads_nowhere_is_said_where_it_is_used(tmp_path: Path) -> None:
    folder = stored(tmp_path)
    change_part(folder, "deformation", lambda t: t["head_mean.bias"].fill_(1e38))
    scene = load_scene(folder)
    with pytest.raises(InputError, match=r"motion cannot be used: at 0\.5 s Gaussians lie more than 1e"):
        render_scene(scene, scene.cameras[0], 0.5)


@pytest.mark.parametrize("kind", ["hexplane", "vibration"])
def test_other_motions_are_bounded(tmp_path: Path, kind: str) -> None:
    save_scene(make_baseline(kind), tmp_path / "s")
    for name in ("resolution", "features", "width") if kind == "hexplane" else ("interval_s", "cycle_frames"):
        save_scene(make_baseline(kind), tmp_path / "s", replace=True)
        change(tmp_path / "s", lambda index, name=name: index["deformation"].update({name: 10**7}))
        with pytest.raises(InputError, match=f"{name} of the motion is 10000000"):
            load_scene(tmp_path / "s")


@pytest.mark.parametrize(
    ("shape", "end"), [([10**9, 3], 12 * 10**9), ([0, 2**32, 2**32], 0), ([0, 2**63, 2], 0), ([2**40], 2**42)]
)
def test_a_header_that_claims_what_the_file_does_not_hold(tmp_path: Path, shape: list[int], end: int) -> None:
    folder = stored(tmp_path)
    data = json.dumps({"means": {"dtype": "F32", "shape": shape, "data_offsets": [0, end]}}).encode()
    whole = len(data).to_bytes(8, "little") + data
    (folder / "main-static.safetensors").write_bytes(whole)
    digest = hashlib.sha256(whole).hexdigest()
    change(folder, lambda index: index["parts"].update({"main-static.safetensors": digest}))
    with pytest.raises(InputError, match=r"holds no tensors of a scene|is not a complete scene"):
        load_scene(folder)


def test_deep_json_is_refused(tmp_path: Path) -> None:
    folder = stored(tmp_path)
    (folder / "scene.json").write_text("[" * 100_000)
    with pytest.raises(InputError, match="nested too deep"):
        load_scene(folder)
    (folder / "scene.json").write_text('{"a":' * 500 + "1" + "}" * 500)
    with pytest.raises(InputError, match="nested deeper than 32 levels"):
        load_scene(folder)
