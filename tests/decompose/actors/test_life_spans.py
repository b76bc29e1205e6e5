import numpy as np
import pytest

from dreamdrive.decompose.actors.life_spans import ActorView, life_spans, misplaced
from dreamdrive.scene.camera import Camera

CAMERA = Camera(100, 100, 50, 50, 100, 100)
TIMES = (0.0, 0.1, 0.2, 0.3)
NONE = np.zeros((0, 3))


def view(k: int, copies: np.ndarray = NONE, behind_m: float = 50.0, offset_m: float = 0.0) -> ActorView:
    depth = np.full((100, 100), behind_m, np.float32)
    moved = np.eye(4)
    moved[0, 3] = offset_m
    return ActorView(TIMES[k], CAMERA, moved, copies, depth)


def copy_at(x_m: float, z_m: float) -> np.ndarray:
    return np.array([[50 + 100 * x_m / z_m, 50.0, z_m]])


def life(place: tuple[float, float, float], source: int, views: list[ActorView]) -> tuple[float, float]:
    found = life_spans(np.array([place], float), np.array([source]), views, (0.0, 0.5), 0.125, 4.5)
    return float(found[0, 0]), float(found[0, 1])


def test_what_all_frames_see_is_short_lived():
    seen = [view(k, copy_at(0, 10)) for k in range(4)]
    assert life((0, 0, 10), 2, seen) == (0.2, 0.125)


def test_what_lies_behind_the_actor_before_lives_from_the_beginning():
    # In the first two frames something of the actor's own, 3 m nearer, hides it.
    seen = [
        view(0, copy_at(0, 7)),
        view(1, copy_at(0, 7)),
        *(view(k, copy_at(0, 10)) for k in (2, 3)),
    ]
    centre, deviation = life((0, 0, 10), 2, seen)
    assert centre == pytest.approx(0.1)
    assert deviation == pytest.approx(0.125 + 0.6 * 0.1)
    assert life((0, 0, 10), 3, seen) == pytest.approx((0.3, 0.125))  # frame 2 has a copy of its own


def test_what_leaves_the_picture_lives_to_the_end():
    out_m = -8.0
    seen = [view(0, copy_at(0, 10)), *(view(k, offset_m=out_m) for k in (1, 2, 3))]
    centre, _ = life((0, 0, 10), 0, seen)
    assert centre == pytest.approx(0.25)


def test_behind_a_wall_it_lives_until_it_is_seen_again():
    seen = [
        view(0, copy_at(0, 10)),
        view(1, behind_m=5),
        view(2, behind_m=5),
        view(3, copy_at(0, 10)),
    ]
    assert life((0, 0, 10), 0, seen)[0] == pytest.approx(0.1)
    assert life((0, 0, 10), 3, seen)[0] == pytest.approx(0.2)


@pytest.mark.parametrize("beside", [view(1), view(1, copy_at(0, 14))])
def test_what_would_stand_where_the_frame_sees_through_it_does_not_live_on(beside: ActorView):
    assert life((0, 0, 10), 0, [view(0, copy_at(0, 10)), beside]) == (0.0, 0.125)


def test_a_single_glimpse():
    assert life((0, 0, 10), 0, [view(0, copy_at(0, 10))]) == (0.0, 0.125)


def test_unknown_depth_counts_as_seen():
    seen = [view(0, copy_at(0, 10)), view(1, behind_m=0)]
    assert life((0, 0, 10), 0, seen) == (0.0, 0.125)


def test_an_actor_that_turned_shows_another_side() -> None:
    # A surface 1 m to the right of what it turns about is 1 m behind it after a quarter turn.
    moved = np.array([[0, 0, 1.0, -10], [0, 1, 0, 0], [-1, 0, 0, 10], [0, 0, 0, 1]])
    seen = [view(0, copy_at(1, 10)), ActorView(0.1, CAMERA, moved, copy_at(0, 9.0), view(0).depth_m)]
    assert life((1, 0, 10), 0, seen[:1])[0] == pytest.approx(0.0)
    assert life((-2, 0, 10), 0, seen)[0] == pytest.approx(0.25)


def test_what_most_frames_see_past_is_misplaced():
    """One frame put the rim of a car too far away; seen from elsewhere it hangs in the air beside it."""
    car = copy_at(0, 10)
    sees_past = [view(k, car) for k in range(4)]
    rim, roof, hidden = (2.0, 0.0, 10.0), (0.0, 0.0, 10.0), (0.0, 0.0, 14.0)
    assert misplaced(np.array([rim, roof, hidden]), sees_past, 4.5).tolist() == [True, False, False]


def test_what_one_frame_alone_sees_past_is_kept():
    beside = np.array([[2.0, 0.0, 10.0]])
    own = np.concatenate([copy_at(0, 10), copy_at(2, 10)])
    once = [view(0, copy_at(0, 10)), *(view(k, own) for k in (1, 2, 3))]
    assert not misplaced(beside, once, 4.5).any()
    wall = [view(k, copy_at(0, 10), behind_m=5) for k in range(4)]
    assert not misplaced(beside, wall, 4.5).any()
