import numpy as np
import pytest

from dreamdrive.geometry.moving.traffic import MIN_SEEN, USUAL_HEIGHT_M, compared_with_traffic
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.geometry import Focal, Geometry, Ground, Scale

WIDTH, HEIGHT, FOCAL_PX, CAMERA_M = 160, 96, 130.0, 1.6


def street(tall_m: float, frames: int = MIN_SEEN, unit: float = 1.0, left: int = 60) -> Geometry:
    """A box of that height that moves 8 m ahead on a level road; lengths are true metres times ``unit``."""
    camera = Camera(FOCAL_PX, FOCAL_PX, WIDTH / 2, HEIGHT / 2, WIDTH, HEIGHT)
    moving = np.zeros((frames, HEIGHT, WIDTH), np.float32)
    lower, upper = (round(HEIGHT / 2 + FOCAL_PX * (CAMERA_M - up) / 8.0) for up in (0.0, tall_m))
    moving[:, upper:lower, left : left + 30] = 1
    return Geometry(
        cameras=(camera,) * frames,
        depth_m=np.ones_like(moving),
        confidence=np.ones_like(moving),
        sky=np.zeros(moving.shape, bool),
        moving=moving,
        fixed_regions=np.zeros((1, HEIGHT, WIDTH), np.int64),
        region_names=(),
        ground=Ground(np.array([0.0, -1.0, 0.0]), CAMERA_M * unit),
        scale=Scale("poses", 0.0, {"camera height": 1.1}),
        focal=Focal(FOCAL_PX, True),
    )


def ratio(geometry: Geometry) -> float | None:
    others = compared_with_traffic(geometry).others
    assert others["camera height"] == 1.1
    return next((value for words, value in others.items() if "traffic" in words), None)


@pytest.mark.parametrize("unit", [1.0, 0.5, 3.0])
def test_a_car_tells_how_far_the_scale_is_off(unit: float) -> None:
    assert ratio(street(USUAL_HEIGHT_M, unit=unit)) == pytest.approx(1 / unit, rel=0.05)


def test_a_lorry_makes_the_scene_look_too_large() -> None:
    assert ratio(street(2.5)) == pytest.approx(USUAL_HEIGHT_M / 2.5, rel=0.05)


def test_what_is_cut_off_or_seen_too_rarely_tells_nothing() -> None:
    assert ratio(street(USUAL_HEIGHT_M, left=0)) is None
    assert ratio(street(USUAL_HEIGHT_M, frames=MIN_SEEN - 1)) is None


def test_the_largest_disagreement_counts() -> None:
    assert Scale("poses", 0.0, {"a": 1.05, "b": 0.8}).disagreement == pytest.approx(0.2)
    assert Scale("poses", 0.0).disagreement is None
