"""Truth in place of parts: it is true, and reading pixels by it gives the picture."""

import numpy as np
import pytest

from dreamdrive.fit import initialise
from dreamdrive.geometry import reconstruct
from dreamdrive.geometry.options import GeometryOptions
from dreamdrive.scene.clip import Clip, Known
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.geometry import Geometry
from dreamdrive.scene.street.truth import DriveTruth
from dreamdrive_bench.oracle.arms import ARMS, likeness
from dreamdrive_bench.oracle.main import tables
from dreamdrive_bench.oracle.truth import instances_of, true_labels, true_paths, with_true_depth
from dreamdrive_bench.oracle.views import seen
from streetworld import make_street


@pytest.fixture(scope="module")
def street() -> tuple[DriveTruth, Clip, Geometry, Gaussians]:
    from dreamdrive_bench.common.drawn import drawn_clip

    made = make_street(0, 6, 10.0, (160, 96))
    known = Known(made.trajectory.world_from_camera, intrinsics=True, depth_m=0.7 * made.depth_m)
    clip = drawn_clip(made, known=known, hold_out=5)
    rough = reconstruct(clip, GeometryOptions())
    geometry = with_true_depth(rough, clip, made, standing=True, moving=True)
    return made, clip, geometry, initialise(clip, geometry)


def test_depth_is_true_where_it_is_asked_for(street: tuple[DriveTruth, Clip, Geometry, Gaussians]) -> None:
    made, clip, geometry, _ = street
    solid = (made.depth_m > 0) & ~clip.held_out[:, None, None]
    np.testing.assert_allclose(geometry.depth_m[solid], made.depth_m[solid], rtol=1e-4)
    assert (geometry.depth_m[clip.held_out] == 0).all()
    wrong = with_true_depth(geometry, clip, made, standing=False, moving=False)
    np.testing.assert_array_equal(wrong.depth_m, geometry.depth_m)


def test_labels_and_paths_are_those_of_the_boxes(
    street: tuple[DriveTruth, Clip, Geometry, Gaussians],
) -> None:
    made, clip, geometry, seeds = street
    labels, instances = true_labels(made, geometry, seeds), instances_of(made, geometry, seeds)
    np.testing.assert_array_equal(labels.dynamic.numpy(), instances > 0)
    paths = true_paths(made, geometry, clip, seeds, labels)
    assert len(paths) == len(np.unique(instances[instances > 0]))
    for cluster, path in paths.items():
        rows = np.flatnonzero(labels.cluster.numpy() == cluster)
        box = next(box for box in made.boxes if box.instance == instances[rows[0]])
        first, last = (path.world_from_canonical(k) for k in (0, len(path.frames) - 1))
        ways = [box.world_from_box[path.frames[k]] for k in (0, -1)]
        np.testing.assert_allclose(last @ np.linalg.inv(first), ways[1] @ np.linalg.inv(ways[0]), atol=1e-6)


def test_held_out_frames_are_read_from_those_beside_them(
    street: tuple[DriveTruth, Clip, Geometry, Gaussians], monkeypatch: pytest.MonkeyPatch
) -> None:
    made, clip, _, _ = street
    monkeypatch.setattr("dreamdrive_bench.oracle.views.world_of", lambda seed: made)
    monkeypatch.setattr("dreamdrive_bench.street.views.world_of", lambda seed: made)
    view = seen(0, "held_out", clip)
    groups = [view.groups[name] for name in ("standing", "moving", "unseen")]
    assert (np.sum(groups, axis=0) == 1).all()
    found = likeness(view.ceiling, view)
    assert view.groups["moving"][clip.held_out].any()
    assert found["standing"] > 22
    assert found["moving"] > 18
    assert likeness(view.frames, view)["standing"] == 100  # nothing is wrong


def test_the_table_tells_shares_of_what_all_truth_brings() -> None:
    def row(arm: str, all_db: float) -> dict:
        figures = {"all": all_db, "standing": 20.0, "moving": 2 * all_db, "unseen": None}
        return {"arm": arm, "poses": "true", "references": "clean", "seed": 0, "shift_2": figures}

    text = tables([row("none", 20), row("as it is", 21), row("+".join(ARMS[-1]), 24)])
    assert "| as it is | 21.00 | 20.00 | 42.00 | - | 25 / 25 |" in text
