"""The whole pipeline on a street of a few pixels: what it leaves, and that it always leaves the same."""

import json
import shutil
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import av
import cv2
import numpy as np
import pytest
import torch

from dreamdrive import Control, InputError, Outcome, build, generate, load_scene, options
from dreamdrive.decompose import Grouping
from dreamdrive.fit import FitOptions, StaticFit
from dreamdrive.run import codec, production, program_digest
from dreamdrive.run.lock import only_run
from dreamdrive.run.stages import STAGES
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.geometry import Geometry
from dreamdrive.street_network.resize import ResizePad

TINY = Control(frames="0:6", size=(64, 40), hold_out=4, seed=1)
GENERATE = import_module("dreamdrive.generate")
"""The module; by this name the package offers its function."""


def shorten(patch: pytest.MonkeyPatch) -> None:
    """Let a draft be a handful of steps, and the street network look at a quarter of the pixels across."""
    draft = options.QUALITIES["draft"]
    quick = replace(
        draft, static=FitOptions(steps=6), score=replace(draft.score, steps=6), fit=FitOptions(steps=8)
    )
    patch.setitem(options.QUALITIES, "draft", quick)
    choose = ResizePad.choose
    patch.setattr(
        ResizePad, "choose", staticmethod(lambda width, height, across: choose(width, height, across // 4))
    )


@pytest.fixture(autouse=True)
def few_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    shorten(monkeypatch)


def make(out: Path, control: Control = TINY, **changes: object) -> Outcome:
    settings: dict[str, object] = {"prior": "street-world", "options": "draft", **changes}
    return generate(control, out, **settings)  # type: ignore[arg-type]


def scene_bytes(out: Path) -> dict[str, bytes]:
    return {p.name: p.read_bytes() for p in sorted((out / "scene").iterdir())}


def before(finished: Path, stage: str, out: Path) -> Path:
    """A copy of a finished run as it was before a stage began."""
    shutil.copytree(finished, out)
    (out / "report.json").unlink()
    for name in STAGES[STAGES.index(stage) :]:
        shutil.rmtree(out / "stages" / name)
    return out


def test_features_and_paths_count_by_their_content(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Not by their names: another file of the same name makes the prior run again."""
    requests: list[dict[str, dict[str, str]]] = []

    def noted(out: Path, request: dict[str, dict[str, str]], **_: object) -> None:
        requests.append(request)
        raise KeyboardInterrupt

    monkeypatch.setattr(GENERATE, "open_workspace", noted)
    files = {name: tmp_path / f"{name}.file" for name in ("features", "trajectory")}
    control = Control(tmp_path, frames="0:2", **files)
    for text in ("one", "other"):
        for path in files.values():
            path.write_text(text)
        with pytest.raises(KeyboardInterrupt):
            generate(control, tmp_path / "out")
    first, second = (request["digests"] for request in requests)
    assert all(first[name] != second[name] for name in files)
    files["features"].unlink()
    with pytest.raises(InputError, match=r"--features .* does not exist; expected a .safetensors file"):
        generate(control, tmp_path / "out")


def test_the_output_folder_holds_what_is_promised(finished: Path) -> None:
    assert sorted(p.name for p in finished.iterdir()) == [
        "held_out",
        "report.json",
        "report.png",
        "scene",
        "stages",
        "video",
    ]
    assert sorted(p.name for p in (finished / "held_out").iterdir()) == ["0002.png"]
    assert cv2.imread(str(finished / "held_out" / "0002.png")).shape == (40, 64, 3)
    videos = {p.name: _size(p) for p in (finished / "video").iterdir()}
    assert videos == {
        "drive.mp4": (11, 64, 40),
        "recorded_beside_rendered.mp4": (6, 128, 40),
        "panels.mp4": (6, 128, 80),
    }


def test_the_report_says_what_the_design_promises(finished: Path) -> None:
    report = json.loads((finished / "report.json").read_text())
    assert report["version"]
    assert report["seed"] == 1
    assert report["program"] == program_digest()
    assert report["shift_m"] is None  # six frames show no path that could be trusted
    assert report["limits"][-1] == "there is no video from aside, as it could not be trusted"
    assert [actor["id"] for actor in report["actors"]] == list(range(len(report["actors"])))
    assert report["options"]["quality"] == "draft"
    assert set(STAGES) <= set(report["stages"])
    assert report["steps"] == {"static": 6, "fit": 8, "score": 6}
    for record in report["stages"].values():
        assert set(record) == {"seconds", "peak_rss_mb", "cached"}
        assert record["peak_rss_mb"] > 50
    scene = load_scene(finished / "scene")
    assert report["gaussians"] == {"static": len(scene.static), "dynamic": len(scene.dynamic)}
    assert set(report["scale"]) == {"source", "spread", "others", "basis", "against", "disagreement"}
    assert set(report["focal"]) == {"px", "observed"}
    assert report["requested"] is None
    assert list(report["held_out"]) == ["2"]
    assert set(report["held_out"]["2"]) == {"psnr", "ssim"}
    assert set(report["baselines"]) == {"repeat_previous", "average_neighbours", "flow_interpolation"}
    assert "detected" in report
    assert "fallback" in report
    assert report["rough"][0].startswith("there are only 6 frames. ")
    assert [line.split()[0] for line in report["limits"][:2]] == ["they", "views"]
    assert "km/h in the mean: a guess" in report["limits"][2]
    assert cv2.imread(str(finished / "stages" / "first.png")) is not None


def test_a_finished_output_is_left_alone(finished: Path) -> None:
    before = {p: p.stat().st_mtime_ns for p in finished.rglob("*")}
    outcome = make(finished)
    assert outcome.already_finished
    assert (outcome.frames, outcome.size, outcome.held_out) == (6, (64, 40), 1)
    assert list(outcome.seconds) == [*STAGES, "videos"]
    assert outcome.rough[0].startswith("there are only 6 frames. ")
    assert {p: p.stat().st_mtime_ns for p in finished.rglob("*")} == before


@pytest.mark.slow
def test_two_runs_are_byte_identical(finished: Path, tmp_path: Path) -> None:
    make(tmp_path / "again")
    assert scene_bytes(tmp_path / "again") == scene_bytes(finished)


@pytest.mark.parametrize(
    "victim",
    ["fit", *(pytest.param(name, marks=pytest.mark.slow) for name in ("fit_static", "write_videos"))],
)
def test_a_killed_run_goes_on_to_the_same_bytes(
    finished: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, victim: str
) -> None:
    def killed(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    out = before(finished, "fit", tmp_path / "out") if victim == "fit" else tmp_path / "out"
    with monkeypatch.context() as patch:
        patch.setattr(production if victim == "write_videos" else build, victim, killed)
        with pytest.raises(KeyboardInterrupt):
            make(out)
    assert not (out / "report.json").exists()
    seen: list[str] = []
    assert not make(
        out, progress=lambda stage, done, total: seen.append(stage) if total == 0 else None
    ).already_finished
    assert "prior" not in seen
    assert "geometry" not in seen
    assert scene_bytes(out) == scene_bytes(finished)


@pytest.mark.slow
def test_from_recomputes_and_gives_the_same_bytes(finished: Path, tmp_path: Path) -> None:
    make(tmp_path)
    assert not make(tmp_path, recompute_from="group").already_finished
    cached = {k: v["cached"] for k, v in json.loads((tmp_path / "report.json").read_text())["stages"].items()}
    assert [name for name in STAGES if not cached[name]] == ["group", "fit"]
    assert scene_bytes(tmp_path) == scene_bytes(finished)


@pytest.mark.slow
@pytest.mark.parametrize("representation", ["static", "deformable", "hexplane", "vibration"])
def test_the_baselines_come_from_the_same_code(tmp_path: Path, representation: str) -> None:
    taken: dict[str, int] = {}
    chosen = replace(options.QUALITIES["draft"], representation=representation)
    make(tmp_path, options=chosen, progress=lambda stage, done, _: taken.update({stage: done}))
    steps = json.loads((tmp_path / "report.json").read_text())["steps"]
    assert steps == {"static": taken["static"], "fit": taken["fit"]} == {"static": 6, "fit": 8}
    scene = load_scene(tmp_path / "scene")
    assert (len(scene.static) == 0) == (representation != "static")
    assert (len(scene.dynamic) == 0) == (representation == "static")
    assert (scene.deformation is None) == (representation == "static")


@pytest.mark.slow
def test_another_request_is_refused_and_loses_nothing(finished: Path, tmp_path: Path) -> None:
    make(tmp_path)
    before = scene_bytes(tmp_path)
    with pytest.raises(InputError, match=r"\(seed differs\)"):
        make(tmp_path, replace(TINY, seed=2))
    assert scene_bytes(tmp_path) == before
    make(tmp_path, replace(TINY, hold_out=None), force=True)
    assert scene_bytes(tmp_path) != before
    assert not list((tmp_path / "held_out").iterdir())


def test_a_clip_of_nothing_but_sky_is_refused(
    finished: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = codec.read(finished / "stages" / "geometry")
    assert isinstance(found, Geometry)
    nothing = replace(found, sky=np.ones_like(found.sky))
    monkeypatch.setattr(build, "reconstruct", lambda *_, **__: nothing)
    with pytest.raises(InputError, match="no frame shows anything solid"):
        make(before(finished, "geometry", tmp_path / "out"))


@pytest.mark.slow
def test_the_input_counts_by_its_content(tmp_path: Path) -> None:
    picture = np.random.default_rng(0).integers(0, 255, (40, 64, 3), np.uint8)
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        for i in range(3):
            cv2.imwrite(str(tmp_path / folder / f"{i}.png"), np.roll(picture, 2 * i, axis=1))
    make(tmp_path / "out", Control(tmp_path / "a", size=(64, 40)), prior="replay")
    assert make(tmp_path / "out", Control(tmp_path / "b", size=(64, 40)), prior="replay")
    cv2.imwrite(str(tmp_path / "b" / "1.png"), picture)
    with pytest.raises(InputError, match="another input"):
        make(tmp_path / "out", Control(tmp_path / "b", size=(64, 40)), prior="replay")


def _size(path: Path) -> tuple[int, int, int]:
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        return sum(1 for _ in container.decode(stream)), stream.width, stream.height


def spoiled(value: object) -> object:
    """The same kind of thing, of one frame or Gaussian too few."""
    if isinstance(value, Clip):
        return replace(value, rig=(value.rig[0].resized(32, 20),))
    if isinstance(value, Geometry):
        short = {
            name: getattr(value, name)[1:]
            for name in ("cameras", "depth_m", "confidence", "sky", "moving", "spread", "road_users")
        }
        return replace(value, **short)
    if isinstance(value, Gaussians):
        return replace(value, source_frame=value.source_frame + 100)
    if isinstance(value, StaticFit):
        return replace(value, gaussians=value.gaussians.select(torch.arange(3)))
    if isinstance(value, Grouping):
        return replace(value, cluster=value.cluster + 10**6)
    return 2 * torch.ones(3)


@pytest.mark.parametrize("stage", [name for name in STAGES if name != "fit"])
def test_a_stage_that_does_not_fit_the_others_is_computed_again(
    finished: Path, tmp_path: Path, stage: str, caplog: pytest.LogCaptureFixture
) -> None:
    """Checksums and types are right: somebody meant it, or mixed two folders."""
    out = tmp_path / "out"
    shutil.copytree(finished, out)
    (out / "report.json").unlink()
    folder = out / "stages" / stage
    codec.write(folder, spoiled(codec.read(folder)), codec.read_header(folder) or {})
    assert make(out)
    assert f"{stage} is computed again" in caplog.text
    assert scene_bytes(out) == scene_bytes(finished)


def test_a_stage_behind_a_link_is_refused(finished: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    shutil.copytree(finished, out)
    (out / "report.json").unlink()
    (out / "stages" / "geometry").rename(tmp_path / "elsewhere")
    (out / "stages" / "geometry").symlink_to(tmp_path / "elsewhere")
    before = {p.name: p.read_bytes() for p in (tmp_path / "elsewhere").iterdir()}
    with pytest.raises(InputError, match="geometry is a link; dreamdrive neither reads nor writes"):
        make(out)
    assert {p.name: p.read_bytes() for p in (tmp_path / "elsewhere").iterdir()} == before


def test_a_second_run_is_told_at_once(finished: Path) -> None:
    with only_run(finished), pytest.raises(InputError, match="is in use: process"):
        make(finished)
