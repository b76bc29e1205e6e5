"""The inventory of what others may rely on: the public names of all modules that the pages name."""

import dreamdrive
from tests.conftest import ROOT
from tests.public_names import lines, public, told
from tests.snapshot import agrees


def test_the_inventory_is_that_of_today() -> None:
    modules = told()
    assert {"dreamdrive", "dreamdrive.geometry", "dreamdrive.tasks.environment"} <= set(modules)
    agrees(
        ROOT / "tests/snapshots/public_names.txt",
        "\n".join(line for module in modules for line in lines(module)) + "\n",
    )


def test_the_inventory_tells_what_importing_finds() -> None:
    """Syntax trees and the interpreter agree on the names of the package itself."""
    assert public("dreamdrive") - {"__version__"} == set(dir(dreamdrive))
    for name in dir(dreamdrive):
        assert getattr(dreamdrive, name).__name__ == name


def test_parameters_are_those_of_the_definition() -> None:
    found = set(lines("dreamdrive"))
    assert "dreamdrive.Trajectory(world_from_camera, times_s)" in found
    assert "dreamdrive.Scene.without(id)" in found
    assert "dreamdrive.render_scene(scene, camera, t_s, *, exposure, channels, part, of_rig, moment)" in found
