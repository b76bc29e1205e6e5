"""What others may rely on: names, version, and that importing them costs nothing."""

import subprocess
import sys
import tomllib
from typing import get_args

import dreamdrive
from dreamdrive.choices import ExportKind, QualityName, RepresentationName
from dreamdrive.export import KINDS
from dreamdrive.motion import REPRESENTATIONS
from dreamdrive.options import QUALITIES
from tests.conftest import ROOT

PUBLIC = [
    "Camera",
    "Clip",
    "Control",
    "Gaussians",
    "Geometry",
    "Given",
    "InputError",
    "Look",
    "Options",
    "Outcome",
    "Scene",
    "Trajectory",
    "build_scene",
    "generate",
    "load_scene",
    "look",
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


def test_names_are_those_of_what_there_is() -> None:
    assert set(get_args(QualityName)) == set(QUALITIES)
    assert set(get_args(ExportKind)) == set(KINDS)
    assert set(get_args(RepresentationName)) == set(REPRESENTATIONS)


def test_priors_load_without_the_packages_of_networks() -> None:
    code = (
        "import sys; sys.modules.update(diffusers=None, transformers=None)\n"
        "from dreamdrive.choices import PRIORS\n"
        "print([prior.name for prior in PRIORS.values()] == list(PRIORS))"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "True"
