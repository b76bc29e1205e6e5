"""What others may rely on: names, version, and that importing them costs nothing."""

import json
import pydoc
import subprocess
import sys
import tomllib
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any, get_args

import pytest

import dreamdrive
from dreamdrive import Control, InputError, Options
from dreamdrive.motion import REPRESENTATIONS
from dreamdrive.names import QualityName, RepresentationName
from dreamdrive.options import QUALITIES, options_of
from dreamdrive.prior import PRIORS
from tests.conftest import ROOT
from tests.scene.scenes import make_scene


def test_type_checkers_see_the_same_names() -> None:
    text = (ROOT / "src/dreamdrive/__init__.py").read_text()
    for name in dreamdrive.__all__:
        assert f"{name} as {name}" in text


def test_the_version_is_that_of_the_package() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert dreamdrive.__version__ == project["version"]
    assert f"## {dreamdrive.__version__}" in (ROOT / "CHANGELOG.md").read_text()


FRESH = """
import json, sys
said = {}
import dreamdrive.cli.main
said["by the commands"] = sorted({"torch", "cv2", "numpy", "pycolmap"} & set(sys.modules))
import dreamdrive.prior, dreamdrive.splat
said["by priors"] = sorted({"diffusers", "transformers", "accelerate", "gsplat"} & set(sys.modules))
said["strings for paths"] = repr(dreamdrive.Control("a.mp4", poses="b", fill="network"))
sys.modules.update(diffusers=None, transformers=None)
from dreamdrive.prior import PRIORS
said["without networks"] = [prior.name for prior in PRIORS.values()]
said["names"] = list(PRIORS)
print(json.dumps(said))
"""


@pytest.fixture(scope="module")
def fresh() -> dict[str, Any]:
    """What an interpreter that has loaded nothing says, in which nothing checks types either."""
    done = subprocess.run([sys.executable, "-c", FRESH], capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


def test_importing_the_package_and_the_commands_loads_nothing_heavy(fresh: dict[str, Any]) -> None:
    assert fresh["by the commands"] == []


def test_priors_and_splats_load_no_network_and_nothing_of_gsplat(fresh: dict[str, Any]) -> None:
    assert fresh["by priors"] == []


def test_names_are_those_of_what_there_is() -> None:
    assert set(get_args(QualityName)) == set(QUALITIES)
    assert set(get_args(RepresentationName)) == set(REPRESENTATIONS)


def test_priors_load_without_the_packages_of_networks(fresh: dict[str, Any]) -> None:
    assert fresh["without networks"] == fresh["names"] == list(PRIORS)


def test_what_people_type_is_understood(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Strings for paths, a quality by its name, the height of the camera; mistakes are sentences."""
    assert Options() == QUALITIES["standard"]
    asked = list[Options]()

    def noted(control: Control, *, options: Options, **_: object) -> None:
        assert control.path == tmp_path / "a.mp4"
        asked.append(options)
        raise KeyboardInterrupt

    monkeypatch.setattr(import_module("dreamdrive.generate"), "request_of", noted)
    clip, out = str(tmp_path / "a.mp4"), str(tmp_path / "out")
    for given in ({}, {"options": "draft"}, {"quality": "draft", "camera_height_m": 1.4}):
        with pytest.raises(KeyboardInterrupt):
            dreamdrive.generate(clip, out, **given)  # type: ignore[arg-type]
    draft = QUALITIES["draft"]
    higher = replace(draft, geometry=replace(draft.geometry, camera_height_m=1.4))
    assert asked == [QUALITIES["standard"], draft, higher]
    with pytest.raises(InputError, match="quality 'best': expected draft, standard, high, or an Options"):
        options_of("best")
    with pytest.raises(InputError, match="options or a quality, not both"):
        dreamdrive.generate(clip, out, options=draft, quality="draft")


def test_strings_are_taken_for_paths(fresh: dict[str, Any]) -> None:
    for words in ("path=PosixPath('a.mp4')", "poses=PosixPath('b')", "fill='network'"):
        assert words in fresh["strings for paths"]


def test_a_scene_is_kept_under_a_string(tmp_path: Path) -> None:
    dreamdrive.save_scene(make_scene(), str(tmp_path / "scene"))
    assert len(dreamdrive.load_scene(str(tmp_path / "scene")).static) == len(make_scene().static)


def test_help_lists_the_functions() -> None:
    text = pydoc.plain(pydoc.render_doc(dreamdrive))
    for name in ("generate(", "build_scene(", "load_scene(", "render_scene(", "class Scene", "class Control"):
        assert name in text, name


def test_the_package_runs_as_a_module_and_has_types() -> None:
    result = subprocess.run([sys.executable, "-m", "dreamdrive", "--version"], capture_output=True, text=True)
    assert result.stdout == f"dreamdrive {dreamdrive.__version__}\n"
    assert (Path(dreamdrive.__file__).parent / "py.typed").is_file()
