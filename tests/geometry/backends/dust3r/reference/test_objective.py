"""The authors' loss and optimiser against their numbers."""

from pathlib import Path

import numpy as np
import pytest
import torch
from tests.geometry.backends.dust3r.align.goldens import config, raw, scene
from tests.geometry.backends.dust3r.align.pairs import path_error, street

from dreamdrive.geometry.backends.dust3r.align.areas import half_areas
from dreamdrive.geometry.backends.dust3r.align.graph import graph_of
from dreamdrive.geometry.backends.dust3r.align.spanning_tree import spanning_tree
from dreamdrive.geometry.backends.dust3r.pairmaps import PairMaps
from dreamdrive.geometry.backends.dust3r.reference.adam import descend
from dreamdrive.geometry.backends.dust3r.reference.objective import Objective, raw_parameters
from dreamdrive.splat.torch_threads import one_torch_thread
from geometry.simulated_pairs import Noise, pair_maps


@pytest.mark.parametrize("name", ["A", "B"])
def test_loss_gradient_and_first_steps_are_golden(golden_dir: Path, name: str) -> None:
    maps, _, wanted = scene(golden_dir, name)
    objective = Objective(maps, graph_of(maps))
    parameters = raw(wanted)
    loss = objective(parameters)
    loss.backward()
    assert float(loss.detach()) == pytest.approx(float(wanted["grad.loss"][0]), rel=1e-6)
    for part in ("pw_poses", "im_poses", "im_focals", "im_depthmaps"):
        gradient, target = getattr(parameters, part).grad.numpy(), wanted[f"grad.{part}"]
        np.testing.assert_allclose(gradient, target, atol=1e-4 * np.abs(target).max(), err_msg=part)
    for steps in (1, 5):
        parameters = raw(wanted)
        descend(objective, parameters, steps, of=300)
        for part in ("pw_poses", "im_poses", "im_focals"):
            moved = getattr(parameters, part).detach().numpy()
            np.testing.assert_allclose(moved, wanted[f"step{steps}.{part}"], atol=1e-4, err_msg=part)


# The README has 1e-5 for the first 60 losses and 1e-3 for 300. Scene B keeps the first on Intel's processors
# and misses by 1.1e-5 on AMD's. On A rounding alone parts the curves: misses that are 0 but for it have a
# direction all the same, and Adam takes full steps along it. The authors' own order of operations, rebuilt
# here, misses by 1.4e-5 to 3.7e-5 as the instruction set changes, ours by 2.1e-5; by step 300 that has grown
# a few hundredfold.
@pytest.mark.parametrize(("name", "first", "all_"), [("A", 5e-5, 2e-2), ("B", 2e-5, 2e-2)])
def test_the_loss_falls_as_the_golden_one(golden_dir: Path, name: str, first: float, all_: float) -> None:
    maps, _, wanted = scene(golden_dir, name)
    objective, parameters = Objective(maps, graph_of(maps)), raw(wanted)
    with one_torch_thread():
        losses = descend(objective, parameters, 300)
    apart = np.abs(losses / wanted["cosine.loss"] - 1)
    assert apart[:60].max() < first
    assert apart.max() < all_
    end = objective.start_of(parameters)
    np.testing.assert_allclose(end.focals_px, wanted["cosine.final.focals"], rtol=3e-2)
    np.testing.assert_allclose(end.world_from_camera, wanted["cosine.final.poses"], atol=2e-2)


@pytest.mark.parametrize(
    ("name", "run"), [("A", "linear"), ("A", "modular"), ("B", "modular"), ("B", "fixed")]
)
def test_whole_runs_end_where_the_golden_ones_do(golden_dir: Path, name: str, run: str) -> None:
    maps, inputs, wanted = scene(golden_dir, name)
    objective = Objective(maps, graph_of(maps), "modular" if run == "modular" else "pooled")
    parameters = raw_parameters(spanning_tree(maps, upstream=True, stale_focals=run != "fixed"))
    with one_torch_thread():
        losses = descend(
            objective,
            parameters,
            len(wanted[f"{run}.loss"]),
            schedule="linear" if run == "linear" else "cosine",
        )
    assert losses[0] == pytest.approx(wanted[f"{run}.loss"][0], rel=1e-5)
    assert losses[-1] == pytest.approx(wanted[f"{run}.loss"][-1], rel=2e-2)
    end = objective.start_of(parameters)
    np.testing.assert_allclose(end.focals_px, wanted[f"{run}.final.focals"], rtol=3e-2)
    np.testing.assert_allclose(end.world_from_camera, wanted[f"{run}.final.poses"], atol=2e-2)
    theirs = config(golden_dir)[f"{name}.{run}"]["metrics_final"]
    error = path_error(end.world_from_camera, inputs["gt.cam2world"]) * theirs["traj_len"]
    assert error < 1.2 * theirs["ate_rmse"]


def test_modular_and_pooled_are_one_where_golden_areas_are_equal(golden_dir: Path) -> None:
    maps, _, wanted = scene(golden_dir, "A")
    graph, parameters = graph_of(maps), raw(wanted)
    with torch.no_grad():
        pooled, modular = (float(Objective(maps, graph, kind)(parameters)) for kind in ("pooled", "modular"))
    assert pooled == pytest.approx(modular, rel=1e-6)
    maps, _, wanted = scene(golden_dir, "B")
    graph, parameters = graph_of(maps), raw(wanted)
    with torch.no_grad():
        pooled, modular = (float(Objective(maps, graph, kind)(parameters)) for kind in ("pooled", "modular"))
    assert pooled == pytest.approx(modular, rel=1e-6)  # these sizes differ in shape, not in area


def test_modular_weighs_small_images_more() -> None:
    """The mean of means against the mean of all: an image of half the height counts the same, or half."""
    truth = street(3, 24, 16)
    maps = pair_maps(truth, np.array([(0, 1), (1, 2), (2, 0)]), Noise())
    points, confidence = (
        tuple(
            tuple(side[:8] if image == 2 else side for image, side in zip(edge, pair, strict=True))
            for edge, pair in zip(maps.edges.tolist(), part, strict=True)
        )
        for part in (maps.points, maps.confidence)
    )
    maps = PairMaps(maps.edges, points, confidence)
    areas = np.array([[384, 384], [384, 192], [192, 384]])
    np.testing.assert_array_equal(half_areas(maps, "modular"), 3 * areas)
    np.testing.assert_array_equal(half_areas(maps, "pooled"), np.tile(areas.sum(axis=0), (3, 1)))
    parameters = raw_parameters(spanning_tree(maps))
    with torch.no_grad():
        pooled, modular = (
            float(Objective(maps, graph_of(maps), kind)(parameters)) for kind in ("pooled", "modular")
        )
    assert abs(pooled / modular - 1) > 1e-3
