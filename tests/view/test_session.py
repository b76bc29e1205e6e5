"""What one browser does with a scene, without a browser."""

import numpy as np
import pytest
import torch

from dreamdrive.edit import Copy, Delay, Move, Recolour, Remove, edited
from dreamdrive.errors import InputError
from dreamdrive.scene.scene import Scene
from dreamdrive.view.session import DRIFTS, DRIVES, FREE, PATH, RECORDED, STANDS, Session, vertical_fov_rad
from tests.cli.test_commands import driving
from tests.scene.scenes import make_scene
from tests.view.scenes import drifting


@pytest.fixture
def session() -> Session:
    return Session(driving(make_scene()))


def ahead_and_left(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    ahead = scene.actor(0).ahead(scene.up)
    assert ahead is not None
    return ahead, np.cross(scene.up, ahead)


def test_edits_are_made_one_after_the_other_and_taken_back(session: Session) -> None:
    opened = session.scene
    session.pick(0)
    session.edit(Move(0, 2.0, 1.0))
    session.edit(Delay(0, 0.5))
    assert session.edits == (Move(0, 2.0, 1.0), Delay(0, 0.5))
    wanted = opened.moved(0, 2.0, 1.0).delayed(0, 0.5).actor(0).track
    np.testing.assert_allclose(session.scene.actor(0).track.positions_m, wanted.positions_m)
    np.testing.assert_allclose(session.scene.actor(0).track.times_s, wanted.times_s)
    assert session.undo() == Delay(0, 0.5)
    assert session.undo() == Move(0, 2.0, 1.0)
    assert session.undo() is None
    assert session.scene is opened


def test_a_copy_is_picked_and_a_removed_actor_is_not(session: Session) -> None:
    session.edit(Copy(0, 0.0, 3.0))
    assert session.chosen not in (None, 0)
    session.edit(Remove(session.chosen or 0))
    assert session.chosen is None
    assert [actor.id for actor in session.actors] == [0]
    session.undo()
    assert len(session.actors) == 2


def test_a_wrong_edit_changes_nothing(session: Session) -> None:
    session.edit(Recolour(0, (1.0, 0.0, 0.0)))
    before = session.scene
    with pytest.raises(InputError, match="no actor 7; there are 0"):
        session.edit(Remove(7))
    assert session.scene is before
    assert len(session.edits) == 1


def test_a_drag_is_shown_at_once_and_is_one_edit_in_the_end(session: Session) -> None:
    ahead, left = ahead_and_left(session.scene)
    start = session.scene.actor(0).track.positions_m
    session.pick(0)
    for share in (0.3, 0.7, 1.0):
        session.drag(share * (2 * ahead - 1.5 * left), done=False)
        assert session.edits == ()
        moved = session.scene.actor(0).track.positions_m - start
        np.testing.assert_allclose(moved, np.tile(share * (2 * ahead - 1.5 * left), (2, 1)), atol=1e-9)
    session.drag(2 * ahead - 1.5 * left, done=True)
    assert session.edits == (Move(0, 2.0, -1.5),)
    session.drag(0.001 * ahead, done=True)  # a click on the arrows
    assert session.edits == (Move(0, 2.0, -1.5),)


def test_two_browsers_have_their_own() -> None:
    scene = driving(make_scene())
    one, other = Session(scene), Session(scene)
    one.edit(Remove(0))
    one.clock.set(one.clock.last_s)
    one.layer = "depth"
    assert len(other.actors) == 1
    assert other.clock.t_s == other.clock.first_s
    assert other.layer == "colour"


@pytest.mark.parametrize("drive", [name for name in DRIVES if name not in (FREE, PATH)])
def test_the_camera_follows_each_drive(session: Session, drive: str) -> None:
    session.follow(drive)
    path = session.path_of(drive)
    assert path is not None
    session.clock.set(session.clock.last_s)
    pose = session.pose()
    assert pose is not None
    np.testing.assert_allclose(pose, path.world_from_camera[-1], atol=1e-9)


def test_the_mouse_has_no_pose_and_the_time_of_the_recording(session: Session) -> None:
    session.follow(FREE)
    assert session.pose() is None
    assert (session.clock.first_s, session.clock.last_s) == tuple(session.opened.times_s[[0, -1]])


def test_a_path_needs_two_points(session: Session) -> None:
    with pytest.raises(InputError, match="a path needs two points"):
        session.follow(PATH)
    assert session.drive == RECORDED
    session.add_point(np.array([0.0, 1.5, 0.0]))
    session.add_point(np.array([0.0, 1.5, 8.0]))
    session.seconds = 4.0
    session.follow(PATH)
    assert session.clock.last_s - session.clock.first_s == pytest.approx(4.0)
    assert session.drawn() is session.drawn()
    session.points_m[1] = np.array([0.0, 1.5, 9.0])
    assert session.drawn().length_m == pytest.approx(9.0, abs=0.01)


def test_a_scene_that_drifts_has_no_actors_and_no_path() -> None:
    session = Session(drifting())
    assert session.actors == ()
    assert session.why_no_actors == DRIFTS
    with pytest.raises(InputError, match="no road to draw a path on"):
        session.add_point(np.zeros(3))
    with pytest.raises(InputError, match="no path of the camera"):
        session.edit(Remove(0))


def test_a_scene_without_actors_says_so() -> None:
    assert Session(driving(make_scene(full=False))).why_no_actors == STANDS
    assert Session(driving(make_scene())).why_no_actors is None


def test_the_field_of_view_is_that_of_the_recording(session: Session) -> None:
    recorded = session.opened.cameras[0]
    camera = session.camera(np.eye(4), vertical_fov_rad(recorded), (66, 48))
    assert camera.fy_px == pytest.approx(2 * recorded.fy_px)
    assert (camera.cx_px, camera.cy_px) == (33, 24)


def test_what_is_shown_is_what_edit_makes_but_for_the_street_behind(session: Session) -> None:
    edits = (Move(0, 1.0, 0.0), Copy(0, 0.0, 4.0))
    for edit in edits:
        session.edit(edit)
    made = edited(session.opened, edits)
    t_s = float(session.opened.times_s[1])
    assert torch.equal(session.scene.dynamic_at(t_s).means, made.dynamic_at(t_s).means)
