"""The street benchmark's distances: few dimensions that the truth spans, and ratios that know their doubt."""

import importlib
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from dreamdrive.evaluate.frechet import frechet_distance

FOLDER = Path(__file__).resolve().parents[2] / "benchmarks"
VIEWS = ("shift_1", "shift_2", "shift_3", "raise_1", "yaw_10")
NETWORK = "frechet_efficientnet_lite0"


@pytest.fixture
def distances(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(str(FOLDER))
    return importlib.import_module("_street_distances")


def world(rng: np.random.Generator, mixing: np.ndarray, noise: float) -> dict[str, np.ndarray]:
    """Features of one world: a few things vary, as in 1280 numbers of which few say something."""
    shape = (24, len(mixing))
    return {
        f"{NETWORK}/{view}": (
            rng.normal(size=shape) @ mixing + noise * rng.normal(size=(24, mixing.shape[1]))
        ).astype(np.float32)
        for view in VIEWS
    }


def test_a_basis_is_that_of_the_truth_and_keeps_its_distances(distances: ModuleType) -> None:
    rng = np.random.default_rng(0)
    rows = rng.normal(size=(400, 5)) @ rng.normal(size=(5, 200)) + 3
    basis = distances.principal(rows)
    assert basis.axes.shape == (200, distances.COMPONENTS)
    shown = basis.project(rows)
    np.testing.assert_allclose(shown.mean(axis=0), 0, atol=1e-9)
    apart = np.linalg.norm(rows[0] - rows[1])
    assert np.linalg.norm(shown[0] - shown[1]) == pytest.approx(apart)


def test_few_samples_have_fewer_components(distances: ModuleType) -> None:
    rows = np.random.default_rng(0).normal(size=(40, 200))
    assert distances.principal(rows).axes.shape[1] == 40 // distances.SAMPLES_EACH


def test_ratios_of_like_and_unlike_representations(
    distances: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(distances, "RESAMPLES", 40)
    monkeypatch.setattr(distances, "SPLITS", 10)
    rng = np.random.default_rng(0)
    mixing = rng.normal(size=(8, 300))
    truth = {seed: world(rng, mixing, 0.3) for seed in range(4)}

    def fitted(shift: float) -> dict[int, dict[str, np.ndarray]]:
        return {
            seed: {name: rows + np.float32(shift) for name, rows in found.items()}
            for seed, found in truth.items()
        }

    fits = {"hybrid": fitted(0.5), "static": fitted(2.0), "vibration": fitted(0.505)}
    rows = distances.distance_rows("hybrid", fits, truth, distances.bases_of(truth))
    by = {row["representation"]: row for row in rows}
    assert by["static"]["ratio_high"] < 0.3
    assert not by["static"]["undecided"]
    assert by["hybrid"]["samples"] == 4 * 5 * 24
    against = distances.compared(rows)
    assert [(row["against"], row["representation"]) for row in against] == [
        ("best other", "vibration"),
        ("static", "static"),
    ]


def test_fid_is_given_in_all_dimensions_as_well(
    distances: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(distances, "RESAMPLES", 4)
    rng = np.random.default_rng(0)
    mixing = rng.normal(size=(8, 150))

    def renamed(found: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        return {name.replace(NETWORK, "fid"): rows for name, rows in found.items()}

    truth = {seed: renamed(world(rng, mixing, 0.3)) for seed in range(2)}
    rows = distances.distance_rows("hybrid", {"hybrid": truth}, truth, distances.bases_of(truth))
    assert [(row["dimensions"], row["projected"]) for row in rows] == [(150, False), (60, True)]


def test_no_excess_of_the_other_gives_no_ratio(distances: ModuleType) -> None:
    assert distances._ratio(1.0, -0.1, None)["ours_over_this"] is None
    alone = distances._ratio(1.0, 4.0, None)
    assert alone["ours_over_this"] == 0.25
    assert alone["undecided"]


def test_distances_by_moments_are_those_by_samples(distances: ModuleType) -> None:
    rng = np.random.default_rng(0)
    real = [rng.normal(size=(30, 4)) for _ in range(3)]
    fake = [rng.normal(size=(30, 4)) @ rng.normal(size=(4, 4)) + 1 for _ in range(3)]
    weights = np.array([[1, 1, 1], [2, 0, 1]])
    found = distances.by_halves({"truth": real, "fake": fake}, weights, 2, rng)
    for draw, clips in enumerate(([0, 1, 2], [0, 0, 2])):
        expected = frechet_distance(
            np.concatenate([real[c] for c in clips]), np.concatenate([fake[c] for c in clips])
        )
        assert found.whole["fake"][draw] == pytest.approx(expected)
        assert found.whole["truth"][draw] == pytest.approx(0, abs=1e-6)
        assert found.half["truth"][draw] > 0
