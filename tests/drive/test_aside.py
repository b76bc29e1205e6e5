"""On which side of a drive there is room."""

import math
from dataclasses import replace

import numpy as np
import pytest
import torch

from dreamdrive.drive import Room, room_of
from dreamdrive.scene.actor import Actor, Track
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.scene import Provenance, Scene
from tests.scene.scenes import make_scene


def standing(right_m: float, ahead_m: tuple[float, float]) -> Gaussians:
    """A wall along the road, 0.5 to 1.5 m above it, a camera height of 1.5 m."""
    z, y = np.meshgrid(np.arange(*ahead_m, 0.2), np.arange(0.0, 1.1, 0.2))
    places = np.column_stack([np.full(z.size, right_m), y.ravel(), z.ravel()])
    count = len(places)
    return Gaussians(
        means=torch.tensor(places, dtype=torch.float32),
        quaternions=torch.tensor([[1.0, 0, 0, 0]]).repeat(count, 1),
        log_scales=torch.full((count, 3), math.log(0.1)),
        logit_opacities=torch.full((count,), 6.0),
        sh=torch.ones(count, 1, 3),
        source_frame=torch.zeros(count, dtype=torch.int64),
    )


def street(*walls: Gaussians, actors: tuple[Actor, ...] = ()) -> Scene:
    """A drive of 20 m straight ahead between walls."""
    made = make_scene(dynamic=0)
    poses = np.tile(np.eye(4), (5, 1, 1))
    poses[:, 2, 3] = 5 * np.arange(5)
    return replace(
        made,
        static=Gaussians.concatenate(*walls),
        deformation=None,
        actors=actors,
        exposure=None,
        cameras=tuple(made.cameras[0].at(pose) for pose in poses),
        times_s=np.arange(5) / 2,
        held_out=np.zeros(5, dtype=bool),
        provenance=Provenance(up=(0.0, -1.0, 0.0), camera_height_m=1.5),
    )


def driving(right_m: float, way_m: tuple[float, float], kind: str = "vehicle") -> Actor:
    places = np.array([[right_m, 1.5, way_m[0]], [right_m, 1.5, way_m[1]]])
    return Actor(0, "actor 0", kind, 0, Track(np.array([0.0, 2.0]), places, np.zeros(2)))


FAR = standing(8.0, (-2.0, 22.0))
NARROW = standing(2.0, (-2.0, 22.0)), standing(-2.0, (-2.0, 10.0))


def side(scene: Scene, shift_m: float = 2.0) -> Room:
    room = room_of(scene, shift_m)
    assert room is not None
    return room


def test_the_free_side_is_taken() -> None:
    both = side(street(FAR))
    assert (both.side, both.free) == ("right", True)
    assert both.why == "nothing is in the way on either side"
    right = side(street(FAR, standing(2.5, (-2.0, 22.0))))
    assert (right.side, right.free, right.taken) == ("left", True, {"left": 0.0, "right": 1.0})
    assert right.why == "100% of the way is taken on the other side"
    assert side(street(FAR, standing(-2.5, (-2.0, 22.0)))).side == "right"


def test_of_two_that_are_taken_the_freer_side_is_taken_and_nearer_both_may_be_free() -> None:
    narrow = side(street(*NARROW))
    assert (narrow.side, narrow.free) == ("left", False)
    assert 0.4 < narrow.taken["left"] < 0.7
    assert narrow.why.endswith("% of the way is taken there, and 100% of the way is taken on the other side")
    assert side(street(*NARROW), 0.8).free


@pytest.mark.parametrize(
    ("actor", "expected"),
    [
        (driving(3.0, (40.0, 10.0)), "left"),
        (driving(-3.0, (40.0, 10.0)), "right"),
        (driving(3.0, (5.0, 30.0)), "right"),  # along
        (driving(7.0, (40.0, 10.0)), "right"),  # beyond the next lane
        (driving(3.0, (40.0, 39.0)), "right"),  # parked
        (driving(3.0, (40.0, 10.0), "unknown"), "right"),
    ],
)
def test_oncoming_traffic_takes_its_lane(actor: Actor, expected: str) -> None:
    room = side(street(FAR, actors=(actor,)))
    assert (room.side, room.free) == (expected, True)
    assert ("traffic comes" in room.why) is (actor.kind == "vehicle" and len(room.oncoming) == 1)


def test_without_a_road_nothing_is_known() -> None:
    assert room_of(replace(street(FAR), provenance=Provenance()), 2.0) is None
