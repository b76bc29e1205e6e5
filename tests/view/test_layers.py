"""What is shown, from the table."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dreamdrive.errors import InputError
from dreamdrive.run import stages_of
from dreamdrive.show import depth_colours, trust_colours
from dreamdrive.splat import render_scene
from dreamdrive.stored import load_scene
from dreamdrive.trust import SceneTrust
from dreamdrive.view.layers import LAYERS, Kept, Looking, layers_of
from dreamdrive.view.recorded import RecordedFrames
from dreamdrive.vision.residual import BLOCK_PX
from tests.cli.test_commands import driving
from tests.scene.scenes import make_scene

NOWHERE = Kept(Path("none"))


@pytest.mark.parametrize("name", ["colour", "depth", "static", "dynamic"])
def test_a_layer_is_what_render_shows(name: str) -> None:
    scene = driving(make_scene())
    camera, t_s = scene.cameras[1], float(scene.times_s[1])
    seen = render_scene(scene, camera, t_s, part=name if name in ("static", "dynamic") else "all")
    wanted = depth_colours(seen.depth_m.numpy()) if name == "depth" else seen.picture
    looking = Looking(NOWHERE)
    drawn = LAYERS[name].draw(looking, scene, camera, t_s)
    assert np.array_equal(drawn, wanted)
    assert np.array_equal(LAYERS[name].draw(looking, scene, camera, t_s), wanted)  # from what was kept


def test_another_scene_or_time_is_drawn_anew() -> None:
    scene = driving(make_scene())
    looking, camera = Looking(NOWHERE), scene.cameras[1]
    for each in (scene, scene.without(0), replace(scene, sky=None)):
        for t_s in (float(scene.times_s[0]), float(scene.times_s[2])):
            for part in ("all", "dynamic"):
                found = looking.at(each, camera, t_s, part).picture
                assert np.array_equal(found, render_scene(each, camera, t_s, part=part).picture)


def test_what_a_scene_lacks_is_not_offered() -> None:
    assert layers_of(driving(make_scene()), NOWHERE) == ("colour", "depth", "static", "dynamic")
    empty = driving(make_scene(dynamic=0, full=False))
    assert layers_of(empty, NOWHERE) == ("colour", "depth", "static")


def test_trust_is_offered_where_the_scene_knows_how_far_it_is_off() -> None:
    scene = driving(make_scene())
    camera, t_s = scene.cameras[1], float(scene.times_s[1])
    blocks = len(scene.cameras), camera.height_px // BLOCK_PX, camera.width_px // BLOCK_PX
    scene = replace(scene, residual=np.full(blocks, 0.02, np.float16))
    assert "trust" in layers_of(scene, NOWHERE)
    looking = Looking(NOWHERE)
    seen = SceneTrust.of(scene).view(camera, t_s)
    wanted = trust_colours(seen.view.picture, seen.trust)
    assert np.array_equal(LAYERS["trust"].draw(looking, scene, camera, t_s), wanted)
    assert looking.trust(scene) is looking.trust(scene)
    assert looking.trust(scene.without(0)) is not looking.trust(scene)


@pytest.mark.slow
def test_a_run_has_scores_and_frames(finished: Path, tmp_path: Path) -> None:
    scene, kept = load_scene(finished / "scene"), Kept(stages_of(finished))
    assert stages_of(finished / "scene") == finished / "stages"
    assert "scores" in layers_of(scene, kept)
    camera, t_s = scene.cameras[2], float(scene.times_s[2])
    picture = LAYERS["scores"].draw(Looking(kept), scene, camera, t_s)
    assert picture.shape == (camera.height_px, camera.width_px, 3)
    assert picture.max() > 0
    recorded = RecordedFrames(kept, scene)
    assert recorded.there
    view, frame = recorded.nearest(t_s + 0.01)
    assert view == 2
    assert frame.shape == picture.shape
    # From the recorded place it lies where the picture has it: half of each.
    own = replace(camera, cx_px=camera.cx_px, cy_px=camera.cy_px)
    over = recorded.over(np.zeros_like(frame), own, t_s).astype(int)
    assert np.abs(2 * over - frame)[2:-2, 2:-2].max() <= 1
    behind = camera.world_from_camera.copy()
    behind[:3, :3] = behind[:3, :3] @ np.diag([-1.0, 1.0, -1.0])
    assert recorded.over(np.zeros_like(frame), camera.at(behind), t_s).max() == 0


def test_scores_that_cannot_be_used_are_refused(tmp_path: Path) -> None:
    for name in ("static", "score"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "result.json").write_text("{}")
    with pytest.raises(InputError, match="scores that cannot be used"):
        _ = Kept(tmp_path).scores
