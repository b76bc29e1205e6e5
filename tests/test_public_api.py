"""What others may rely on: names, version, and that importing them costs nothing."""

import subprocess
import sys
import tomllib
from typing import get_args, get_type_hints

import dreamdrive
from dreamdrive.cli.generate import generate as generate_command
from dreamdrive.geometry import BACKENDS
from dreamdrive.motion import REPRESENTATIONS
from dreamdrive.options import QUALITIES, QualityName
from dreamdrive.prior import PRIORS
from dreamdrive.run.stages import STAGES
from tests.conftest import ROOT

PUBLIC = [
    "Camera",
    "Clip",
    "Control",
    "Gaussians",
    "Geometry",
    "InputError",
    "Outcome",
    "Scene",
    "Trajectory",
    "generate",
    "load_scene",
    "render_scene",
    "save_scene",
]


def test_the_public_names_are_these() -> None:
    assert dir(dreamdrive) == PUBLIC
    for name in PUBLIC:
        assert getattr(dreamdrive, name).__name__ == name


def test_type_checkers_see_the_same_names() -> None:
    text = (ROOT / "src/dreamdrive/__init__.py").read_text()
    for name in PUBLIC:
        assert f"import {name} as {name}\n" in text


def test_the_version_is_that_of_the_package() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert dreamdrive.__version__ == project["version"]
    assert f"## {dreamdrive.__version__}" in (ROOT / "CHANGELOG.md").read_text()


def test_importing_the_package_and_the_commands_loads_nothing_heavy() -> None:
    code = "import sys, dreamdrive.cli.main; print({'torch', 'cv2', 'numpy', 'pycolmap'} & set(sys.modules))"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "set()"


def test_the_command_offers_what_there_is() -> None:
    hints = get_type_hints(generate_command)
    assert set(get_args(get_args(hints["prior"])[0])) == set(PRIORS)
    assert set(get_args(get_args(hints["geometry"])[0])) == set(BACKENDS)
    assert set(get_args(get_args(hints["representation"])[0])) == set(REPRESENTATIONS)
    assert set(get_args(hints["quality"])) == set(QUALITIES) == set(get_args(QualityName))
    assert set(get_args(get_args(hints["recompute_from"])[0])) == set(STAGES)
