"""Correlations and distances of the benchmark of trust, on views whose truth is made up."""

import numpy as np
import pytest

from dreamdrive.trust import MOST, RISING, SHIFTS_M, ErrorNetwork
from dreamdrive_bench.trust.calibrate import calibrated
from dreamdrive_bench.trust.looks import Looks
from dreamdrive_bench.trust.main import falls, judged


def views(seed: int) -> Looks:
    """Blocks whose squared error rises with the first feature, which rises with the distance aside."""
    rng = np.random.default_rng(seed)
    shift_m = np.concatenate([np.zeros(6), *([side * m] * 6 for m in SHIFTS_M if m <= 4 for side in (-1, 1))])
    features = rng.normal(size=(len(shift_m), 4, 5, len(RISING))).astype(np.float32)
    features[..., 0] += 2 * np.log1p(4 * np.abs(shift_m))[:, None, None]
    error = MOST / (1 + np.exp(5 - features[..., 0]))
    return Looks(
        features=features,
        squared_error=error,
        shift_m=shift_m,
        away_m=np.abs(shift_m),
        frame=np.tile(np.arange(6.0), len(shift_m) // 6),
        novel=np.ones(len(shift_m), dtype=bool),
        off=np.zeros(len(shift_m)),
    )


@pytest.fixture(scope="module")
def network() -> ErrorNetwork:
    return calibrated([views(0), views(1)])


def test_a_network_finds_what_errors_follow_from(network: ErrorNetwork) -> None:
    found = judged([views(2)], [network])
    assert found["blocks"] > 0.95
    assert found["views"] > found["views_by_distance"] > 0.5
    assert found["blocks"] > found["blocks_by_distance"] + 0.1
    assert abs(found["bias_db"]) < 1
    rows = falls(views(2), network)
    assert [row["side"] for row in rows] == [-1, 1]
    assert all(row["told_m"] == pytest.approx(row["is_m"], rel=0.3) for row in rows)


def test_errors_of_views_that_no_fit_has_seen_count(network: ErrorNetwork) -> None:
    scene = views(2)
    worse = Looks(
        **{**vars(scene), "squared_error": 2 * scene.squared_error, "off": np.full(len(scene.off), np.log(2))}
    )
    assert judged([worse], [network])["bias_db"] == pytest.approx(
        judged([scene], [network])["bias_db"], abs=0.01
    )
