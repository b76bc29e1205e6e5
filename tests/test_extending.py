"""Packages of others: the one of docs/extending.md adds one of each, and those that are wrong say so."""

import json
import re
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from dreamdrive import Control, InputError, generate, load_scene, options
from dreamdrive.data.table import DATASETS
from dreamdrive.fit import FitOptions
from dreamdrive.geometry import BACKENDS
from dreamdrive.prior import PRIORS
from dreamdrive.stored import save_scene
from tests.cli.conftest import Run, run  # noqa: F401 - a fixture
from tests.conftest import ROOT
from tests.scene.scenes import make_scene

PAGE = (ROOT / "docs/extending.md").read_text()
TINY = Control(frames="0:4", size=(64, 40), seed=1)

Install = Callable[..., None]


def modules() -> dict[str, str]:
    """The modules of the page by their paths."""
    return dict(re.findall(r"^`(roadside/\w+\.py)`\n\n```python\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE))


def entry_points() -> str:
    """The entry points of the page as an installer writes them down."""
    table = re.findall(r"```toml\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE)[0].replace('"', "")
    return table[table.index("[project.entry") :].replace("project.entry-points.", "")


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Install:
    """Puts packages where Python finds them, as an installer does."""

    def put(name: str, entries: str, files: dict[str, str]) -> None:
        site = tmp_path / f"site-{name}"
        info = site / f"{name}-1.0.dist-info"
        info.mkdir(parents=True)
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
        (info / "entry_points.txt").write_text(entries)
        for path, text in files.items():
            (site / path).parent.mkdir(exist_ok=True)
            (site / path).write_text(text)
        for module in [each for each in sys.modules if each.partition(".")[0] == name]:
            monkeypatch.delitem(sys.modules, module)
        monkeypatch.syspath_prepend(site)

    return put


@pytest.fixture
def roadside(install: Install) -> None:
    install("roadside", entry_points(), {"roadside/__init__.py": "", **modules()})


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    draft = options.QUALITIES["draft"]
    few = replace(draft, static=FitOptions(steps=4), fit=FitOptions(steps=4), representation="static")
    few = replace(few, knowledge="none")
    few = replace(few, geometry=replace(draft.geometry, method="level"))
    monkeypatch.setitem(options.QUALITIES, "draft", few)


def drive(folder: Path) -> Path:
    (folder / "images").mkdir(parents=True)
    picture = np.random.default_rng(0).integers(0, 255, (40, 64, 3), np.uint8)
    for i in range(4):
        cv2.imwrite(str(folder / f"images/{i}.png"), np.roll(picture, i, axis=1))
    (folder / "odometer.txt").write_text("5\n6.5\n8\n9\n")
    return folder


@pytest.mark.usefixtures("roadside")
def test_names_are_known_without_the_package_being_imported() -> None:
    assert list(PRIORS)[-1] == "fog"
    assert "level" in BACKENDS
    assert "odometer" in DATASETS
    assert PRIORS.package("fog") == {"roadside": "1.0"}
    assert PRIORS.package("replay") == {}
    assert "roadside" not in sys.modules
    assert PRIORS["fog"].name == "fog"
    assert "roadside.prior" in sys.modules
    assert "roadside.geometry" not in sys.modules


@pytest.mark.usefixtures("roadside", "quick")
def test_a_scene_of_an_outside_prior_and_geometry(tmp_path: Path) -> None:
    generate(TINY, tmp_path / "out", prior="fog", options="draft")
    report = json.loads((tmp_path / "out/report.json").read_text())
    assert report["versions"]["roadside"] == "1.0"
    assert report["options"]["prior"] == "fog"
    assert report["scale"]["source"] == "the height of the camera"


@pytest.mark.usefixtures("roadside", "quick")
def test_a_scene_of_an_outside_data_set(tmp_path: Path) -> None:
    control = replace(TINY, path=drive(tmp_path / "drive"), dataset="odometer", frames="1:4")
    assert not generate(control, tmp_path / "out", options="draft").already_finished
    ahead_m = [camera.world_from_camera[2, 3] for camera in load_scene(tmp_path / "out/scene").cameras]
    np.testing.assert_allclose(ahead_m, [0, 1.5, 2.5])
    assert generate(control, tmp_path / "out", options="draft").already_finished
    (tmp_path / "drive/odometer.txt").write_text("5\n6\n8\n9\n")
    with pytest.raises(InputError, match="other input"):
        generate(control, tmp_path / "out", options="draft")


@pytest.mark.usefixtures("roadside")
def test_what_a_data_set_does_not_take_or_know(tmp_path: Path, run: Run) -> None:  # noqa: F811
    said = run("generate", tmp_path, "--dataset", "odometer", "-o", tmp_path / "out")
    assert said.code == 2
    assert f"--dataset odometer: {tmp_path} is not one of it; expected a folder with images and" in said.err
    control = Control(drive(tmp_path / "drive"), dataset="odometer", hfov_deg=60.0)
    with pytest.raises(
        InputError, match=r"takes no --hfov; it takes --dataset, --fps, --frames, --hold-out, --size"
    ):
        PRIORS["replay"](control)


@pytest.mark.usefixtures("roadside")
def test_commands_and_doctor_know_them(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:  # noqa: F811
    monkeypatch.setenv("COLUMNS", "400")
    said = run("generate", "--help").out
    for name in ("fog}", "level}", "odometer}"):
        assert name in said
    said = run("doctor").out
    assert "prior fog: street-world on a foggy day" in said
    assert "package: roadside 1.0" in said
    assert "data set odometer: a folder with images" in said
    assert "export xyz: centres of Gaussians as text" in said


@pytest.mark.usefixtures("roadside")
def test_an_export_is_taken_by_its_name(run: Run, tmp_path: Path) -> None:  # noqa: F811
    save_scene(make_scene(), tmp_path / "scene")
    wanted = ("export", tmp_path / "scene", "--to", "xyz", "-o")
    assert run(*wanted, tmp_path / "points.xyz").code == 0
    assert len((tmp_path / "points.xyz").read_text().splitlines()) == 7
    assert "exists already" in run(*wanted, tmp_path / "points.xyz").err
    assert "expected a name that ends in .xyz" in run(*wanted, tmp_path / "points.ply").err


ENTRY = "[dreamdrive.priors]\n{} = {}\n"


def test_a_package_that_cannot_be_loaded_is_named(install: Install, run: Run) -> None:  # noqa: F811
    install(
        "broken", ENTRY.format("sora", "broken:SORA"), {"broken.py": "import a_package_that_is_not_there"}
    )
    message = (
        r"--prior sora: the package broken 1.0 cannot be loaded \(ModuleNotFoundError: No module .*there'\)"
    )
    with pytest.raises(InputError, match=message):
        PRIORS.choose("sora")
    assert "prior sora: cannot be used --prior sora: the package broken 1.0" in run("doctor").out


def test_an_entry_of_another_kind_is_refused(install: Install) -> None:
    install("other", ENTRY.format("sora", "other:SORA"), {"other.py": "SORA = 3"})
    with pytest.raises(InputError, match=r"other 1.0 gives no Prior called sora, but 3"):
        PRIORS.choose("sora")


def test_names_that_are_taken(install: Install, caplog: pytest.LogCaptureFixture) -> None:
    install("one", ENTRY.format("sora", "one:A") + "replay = one:A\n", {"one.py": "A = 1"})
    install("two", ENTRY.format("sora", "two:A"), {"two.py": "A = 2"})
    with pytest.raises(InputError, match=r"--prior sora: one 1.0 and two 1.0 both have one; uninstall one"):
        PRIORS.choose("sora")
    assert PRIORS.choose("replay").name == "replay"
    assert "--prior replay is dreamdrive's own; that of one 1.0 is not used" in caplog.text
    assert list(PRIORS).count("sora") == list(PRIORS).count("replay") == 1


def test_the_nearest_name_is_told() -> None:
    with pytest.raises(InputError, match=r"--geometry dust3: unknown; .*; did you mean dust3r"):
        BACKENDS.choose("dust3")


def test_own_entries_are_what_they_are_called() -> None:
    for table in (PRIORS, BACKENDS, DATASETS):
        assert [entry.name for entry in table.values()] == list(table)
