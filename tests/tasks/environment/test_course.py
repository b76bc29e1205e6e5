from dataclasses import replace

import numpy as np
import pytest
import shapely

from dreamdrive.errors import InputError
from dreamdrive.scene.scene import Scene
from dreamdrive.tasks.environment.bicycle import EgoOptions, EgoState
from dreamdrive.tasks.environment.course import STANDING, Course, course_of
from dreamdrive.tasks.environment.road import DrivableArea
from tests.scene.scenes import per_frame_scene
from tests.tasks.environment.scenes import AHEAD, SPEED_M_S, WALL_M, Path, scene

EGO = EgoOptions()


def course(made: Scene, road: DrivableArea | None = None, margin_m: float = 0.5) -> Course:
    return course_of(made, "a scene", road, EGO, margin_m)


def hit(known: Course, x_m: float, y_m: float, yaw_rad: float = 0.0, time_s: float = 0.0) -> str:
    states = known.road_users.states(np.full(len(known.road_users), time_s))
    return known.hit(EgoState(x_m, y_m, yaw_rad, 0.0).rectangle(EGO), states)


def test_the_recorded_car_hits_nothing() -> None:
    known = course(scene(AHEAD))
    for time_s in (0.0, 0.7, 1.5, 3.0):
        state = known.recorded(time_s)
        assert hit(known, state.x_m, state.y_m, state.yaw_rad, time_s) == ""
        assert state.speed_m_s == pytest.approx(SPEED_M_S, rel=0.02)


def test_a_wall_is_hit_at_about_its_place() -> None:
    known = course(scene())
    beside_m = WALL_M + EGO.width_m / 2
    assert hit(known, 5.0, beside_m - 0.3) == STANDING
    assert hit(known, 5.0, beside_m + 0.4) == ""
    assert hit(known, 5.0, beside_m + 0.4, -0.5) == STANDING


def test_an_actor_is_hit_where_it_is_at_that_time() -> None:
    known = course(scene(AHEAD))
    front_m = EGO.middle_ahead_m + EGO.length_m / 2
    rear_m = AHEAD[0] - 2.2
    assert hit(known, rear_m - front_m + 0.1, 0.0) == "actor 0"
    assert hit(known, rear_m - front_m - 0.1, 0.0) == ""
    assert hit(known, rear_m - front_m + 0.1, 0.0, time_s=1.0) == ""


def test_a_wrong_box_and_what_is_not_there_are_not_hit() -> None:
    wrong: Path = (3.5, 0.0, SPEED_M_S, 0.0)
    assert hit(course(scene(wrong)), 0.0, 0.0) == ""
    known = course(scene(AHEAD, seen_s=(1.0, 2.0)))
    assert hit(known, AHEAD[0], 0.0) == ""
    assert hit(known, AHEAD[0] + 1.5 * SPEED_M_S, 0.0, time_s=1.5) == "actor 0"


def test_the_front_camera_is_where_it_was_recorded() -> None:
    known = course(scene())
    state = known.recorded(1.2)
    pose = known.world_from_ego(state, known.path.along_at(1.2)) @ known.ego_from_front
    np.testing.assert_allclose(pose, known.scene.cameras[12].world_from_camera, atol=0.02)
    np.testing.assert_allclose(known.ego_from_front[:3, 3], [1.7, 0.0, 1.5], atol=1e-6)


def test_a_road_that_the_recorded_car_leaves_is_not_its_road() -> None:
    narrow = DrivableArea(shapely.box(-50, -1.5, 200, 0.2))
    with pytest.raises(InputError, match=r"0\.73 m outside of the road, and road_margin_m is 0\.5"):
        course(scene(), narrow)
    assert course(scene(), narrow, margin_m=0.8).road is narrow


def test_scenes_that_cannot_be_driven_in_are_refused() -> None:
    about = replace(scene().provenance, camera_height_m=None)
    with pytest.raises(InputError, match="does not know its road"):
        course(replace(scene(), provenance=about))
    per_frame = per_frame_scene()
    about = replace(per_frame.provenance, camera_height_m=1.5)
    with pytest.raises(InputError, match="single frames"):
        course(replace(per_frame, provenance=about))
