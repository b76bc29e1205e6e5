"""Results of stages are kept, found again, and never trusted when damaged."""

import json
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
import torch

from dreamdrive import progress
from dreamdrive.errors import InputError
from dreamdrive.files.digest import digest, file_digest, stage_seed
from dreamdrive.run import codec, stages
from dreamdrive.run.stages import STAGES, Stages
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.geometry import Geometry
from dreamdrive.scene.street.log import OfLog
from dreamdrive.scene.street.look import RoadUser
from dreamdrive.scene.street.street_class import StreetClass
from tests.scene.scenes import make_scene
from tests.streets import small_street, street_clip, true_geometry

old = stages.program_of


class Work:
    """Counts how often it is asked to compute."""

    def __init__(self, folder: Path, recompute_from: str | None = None) -> None:
        self.calls: list[str] = []
        self.seen: list[tuple[str, int, int]] = []
        self.stages = Stages(folder, recompute_from, lambda *step: self.seen.append(step), lambda: None)

    def run(self, name: str, options: object = None) -> torch.Tensor:
        def compute(progress: object) -> torch.Tensor:
            self.calls.append(name)
            progress(1, 1)  # type: ignore[operator]
            return torch.arange(5.0)

        return self.stages(name, options, compute)

    def chain(self) -> None:
        self.run("prior")
        self.run("geometry")
        self.run("initialise")


def test_a_result_is_computed_once(tmp_path: Path) -> None:
    first, second = Work(tmp_path), Work(tmp_path)
    first.chain()
    second.chain()
    assert first.calls == ["prior", "geometry", "initialise"]
    assert second.calls == []
    assert [r.cached for r in second.stages.records.values()] == [True] * 3
    assert second.stages.records["prior"].seconds == first.stages.records["prior"].seconds


def test_a_changed_option_recomputes_the_stage_and_what_follows(tmp_path: Path) -> None:
    Work(tmp_path).chain()
    work = Work(tmp_path)
    work.run("prior")
    work.run("geometry", {"height_m": 2.2})
    work.run("initialise")
    assert work.calls == ["geometry", "initialise"]


def test_from_recomputes_a_stage_and_all_later_ones(tmp_path: Path) -> None:
    Work(tmp_path).chain()
    work = Work(tmp_path, recompute_from="geometry")
    work.chain()
    assert work.calls == ["geometry", "initialise"]


@pytest.mark.parametrize("damage", ["cut", "other", "gone", "json", "version"])
def test_damage_is_noticed_and_repaired(tmp_path: Path, damage: str) -> None:
    Work(tmp_path).chain()
    arrays, document = tmp_path / "geometry" / "result.safetensors", tmp_path / "geometry" / "result.json"
    if damage == "cut":
        arrays.write_bytes(arrays.read_bytes()[:-3])
    elif damage == "other":
        data = bytearray(arrays.read_bytes())
        data[-1] ^= 1
        arrays.write_bytes(bytes(data))
    elif damage == "gone":
        arrays.unlink()
    elif damage == "json":
        document.write_text(document.read_text()[:40])
    else:
        document.write_text("[]")
    work = Work(tmp_path)
    work.chain()
    assert work.calls == ["geometry"]
    again = Work(tmp_path)
    again.chain()
    assert again.calls == []


def test_gaussians_that_cannot_be_drawn_are_no_result(tmp_path: Path) -> None:
    fine = make_scene().static
    codec.write(tmp_path, fine, {})
    assert len(codec.read(tmp_path, Gaussians)) == len(fine)
    codec.write(tmp_path, replace(fine, quaternions=torch.zeros(len(fine), 4)), {})
    with pytest.raises(codec.DamagedError, match="quaternions of length 0"):
        codec.read(tmp_path)


def test_a_kill_between_the_two_files_leaves_no_mixture(tmp_path: Path) -> None:
    codec.write(tmp_path, np.arange(3), {"key": "old"})
    old = (tmp_path / "result.json").read_bytes()
    codec.write(tmp_path, np.arange(4), {"key": "new"})
    (tmp_path / "result.json").write_bytes(old)
    with pytest.raises(codec.DamagedError, match="not the file"):
        codec.read(tmp_path)


def test_an_interrupted_stage_leaves_the_earlier_ones(tmp_path: Path) -> None:
    work = Work(tmp_path)
    work.run("prior")

    def killed(progress: object) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        work.stages("geometry", None, killed)
    again = Work(tmp_path)
    again.chain()
    assert again.calls == ["geometry", "initialise"]


def test_progress_names_the_stage(tmp_path: Path) -> None:
    work = Work(tmp_path)
    work.run("prior")
    assert work.seen == [("prior", 0, 0), ("prior", 1, 1)]


def test_nouns_come_back_equal(tmp_path: Path) -> None:
    street = small_street(frames=4)
    rows = tuple(tuple(map(float, row)) for row in np.eye(4) / 3)
    link = OfLog("scene-0061", rows, 0.3, level_z_m=-0.1)
    clip, geometry = replace(street_clip(street, hold_out=4), log=link), true_geometry(street)
    for noun in (clip, geometry):
        codec.write(tmp_path, noun, {})
        _assert_equal(codec.read(tmp_path), noun)
    assert isinstance(codec.read(tmp_path), Geometry)


def test_odd_values_come_back_equal(tmp_path: Path) -> None:
    value = {
        "infinite": float("inf"),
        "tuple": (1, "two", None, (True,)),
        "list": [1.5, {"array": "a text, not an array"}],
        "empty": np.zeros((0, 3), np.float32),
        "scalar": np.float32(0.25),
        "transposed": np.arange(6).reshape(2, 3).T,
        "half": torch.ones(2, 2, dtype=torch.float16),
    }
    codec.write(tmp_path, value, {})
    back = codec.read(tmp_path)
    _assert_equal(back, {**value, "scalar": 0.25})


def test_only_known_nouns_are_stored_or_read(tmp_path: Path) -> None:
    @dataclass(frozen=True)
    class Camera:
        name: str

    with pytest.raises(ValueError, match="cannot store a Camera"):
        codec.write(tmp_path, Camera("looks like ours"), {})
    codec.write(tmp_path, None, {})
    document = json.loads((tmp_path / "result.json").read_text())
    document["value"] = {"noun": "os.system", "fields": {}}
    (tmp_path / "result.json").write_text(json.dumps(document))
    with pytest.raises(codec.DamagedError):
        codec.read(tmp_path)


def test_a_stage_of_other_storage_is_kept_as_well(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def read(path: Path) -> str:
        if not path.exists():
            raise InputError("gone")
        return path.read_text()

    monkeypatch.setattr(stages, "save_scene", lambda value, path, replace: _write_text(path, value))
    monkeypatch.setattr(stages, "load_scene", read)
    for expected in (["made"], []):
        calls: list[str] = []
        value = Work(tmp_path).stages("fit", None, lambda _, calls=calls: calls.append("made") or "text")
        assert (value, calls) == ("text", expected)
    (tmp_path / "fit" / "value").unlink()
    assert Work(tmp_path).stages("fit", None, lambda _: "again") == "again"


def test_a_changed_program_computes_its_stage_and_what_follows_and_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    Work(tmp_path).chain()
    monkeypatch.setattr(stages, "program_of", lambda name: "another" if name == "geometry" else old(name))
    work, said = Work(tmp_path), list[str]()
    work.stages.say = said.append
    work.chain()
    assert work.calls == ["geometry", "initialise"]
    assert said == ["The program has changed since: geometry and what rests on it are computed again."]
    again = Work(tmp_path)
    again.stages.say = said.append
    again.chain()
    assert (again.calls, len(said)) == ([], 1)


def test_what_is_given_is_not_computed_and_counts_by_its_content(tmp_path: Path) -> None:
    for given, expected in (
        (torch.zeros(3), ["initialise"]),
        (torch.zeros(3), []),
        (torch.ones(3), ["initialise"]),
    ):
        work = Work(tmp_path)
        assert work.stages("geometry", None, lambda _: torch.ones(9), given=given) is given
        work.run("initialise")
        assert work.calls == expected


def test_a_kill_inside_a_stage_leaves_its_finished_parts(tmp_path: Path) -> None:
    made: list[str] = []

    def part(name: str) -> torch.Tensor:
        made.append(name)
        return torch.arange(3.0)

    def stage(work: progress.Work, killed: bool) -> torch.Tensor:
        first = work.keep("first", lambda: part("first"))
        if killed:
            raise KeyboardInterrupt
        return first + work.part(1, 2).keep("first", lambda: part("second"))

    with pytest.raises(KeyboardInterrupt):
        Work(tmp_path).stages("geometry", "slow", lambda work: stage(work, killed=True))
    work = Work(tmp_path)
    assert work.stages("geometry", "slow", lambda work: stage(work, killed=False)).tolist() == [0, 2, 4]
    assert made == ["first", "second"]
    assert not (tmp_path / "geometry.parts").exists()
    work = Work(tmp_path)
    with pytest.raises(KeyboardInterrupt):
        work.stages("geometry", "other", lambda work: stage(work, killed=True))
    assert made == ["first", "second", "first"]


def test_a_full_disk_is_one_clear_message(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    codec.write(tmp_path, np.arange(3), {})

    def full(*_: object, **__: object) -> int:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(InputError, match="No space left on device"):
        codec.write(tmp_path, np.arange(30), {})
    monkeypatch.undo()
    assert np.array_equal(codec.read(tmp_path), np.arange(3))  # type: ignore[arg-type]
    assert sorted(p.name for p in tmp_path.iterdir()) == ["result.json", "result.safetensors"]


def test_digests_follow_content_and_names_only(tmp_path: Path) -> None:
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "0.png").write_bytes(b"same")
    assert file_digest(tmp_path / "a") == file_digest(tmp_path / "b")
    (tmp_path / "b" / ".hidden").write_bytes(b"not seen")
    assert file_digest(tmp_path / "a") == file_digest(tmp_path / "b")
    (tmp_path / "b" / "0.png").rename(tmp_path / "b" / "1.png")
    assert file_digest(tmp_path / "a") != file_digest(tmp_path / "b")


def test_a_folder_behind_a_link_counts(tmp_path: Path) -> None:
    """Weights are joined by links; another one must not go unnoticed, and a circle of them must end."""
    for name in ("first", "second"):
        (tmp_path / name / "unet").mkdir(parents=True)
        (tmp_path / name / "unet" / "weights").write_text(name)
    joined = tmp_path / "joined"
    joined.mkdir()
    (joined / "unet").symlink_to(tmp_path / "first" / "unet")
    (joined / "circle").symlink_to(joined)
    first = file_digest(joined, deep=True)
    assert first == file_digest(tmp_path / "first", deep=True)
    assert first == file_digest(joined, deep=True)
    (joined / "unet").unlink()
    (joined / "unet").symlink_to(tmp_path / "second" / "unet")
    assert file_digest(joined, deep=True) == file_digest(tmp_path / "second", deep=True) != first
    (tmp_path / "first" / "back").symlink_to(joined)
    (joined / "there").symlink_to(tmp_path / "first")
    assert file_digest(joined, deep=True) != first


def test_each_stage_has_its_own_seed() -> None:
    seeds = {stage_seed(seed, name) for seed in (0, 1) for name in STAGES}
    assert len(seeds) == 2 * len(STAGES)
    assert all(0 <= seed < 2**31 for seed in seeds)
    assert digest({"b": 1, "a": (2,)}) == digest({"a": [2], "b": 1})


def _write_text(path: Path, value: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(value)


def _assert_equal(a: object, b: object) -> None:
    """Same types, same shapes, same bits."""
    assert type(a) is type(b)
    if isinstance(a, np.ndarray | torch.Tensor):
        assert isinstance(b, type(a))
        assert a.dtype == b.dtype
        assert a.shape == b.shape
        assert (a == b).all()
    elif hasattr(a, "__dataclass_fields__"):
        for name in a.__dataclass_fields__:  # type: ignore[attr-defined]
            _assert_equal(getattr(a, name), getattr(b, name))
    elif isinstance(a, dict):
        assert isinstance(b, dict)
        assert list(a) == list(b)
        for name in a:
            _assert_equal(a[name], b[name])
    elif isinstance(a, list | tuple):
        assert isinstance(b, list | tuple)
        assert len(a) == len(b)
        for x, y in zip(a, b, strict=True):
            _assert_equal(x, y)
    else:
        assert a == b


def test_what_a_look_holds_comes_back_as_it_was(tmp_path: Path) -> None:
    users = (
        RoadUser(StreetClass.VEHICLE, 0.8, (0, 3, 6, 6), 18),
        RoadUser(StreetClass.PERSON, 1.0, (1, 1, 2, 2), 1),
    )
    codec.write(tmp_path, users, {})
    assert codec.read(tmp_path, tuple) == users
    document = json.loads((tmp_path / codec.JSON_NAME).read_text())
    (tmp_path / codec.JSON_NAME).write_text(json.dumps(document).replace('"PERSON"', '"GHOST"'))
    with pytest.raises(codec.DamagedError, match="GHOST"):
        codec.read(tmp_path)
