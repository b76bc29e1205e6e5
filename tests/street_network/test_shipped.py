"""The network by name and by file, and what the weights that ship answer.

After new weights ``python tests/street_network/test_shipped.py`` writes their answers anew.
"""

import json
from pathlib import Path

import numpy as np
import pytest
import torch

from dreamdrive.errors import InputError
from dreamdrive.scene.street.street_class import StreetClass
from dreamdrive.scene.street.truth import DriveTruth
from dreamdrive.street_network import LookOptions, load_knowledge, look, shipped
from dreamdrive.street_network.network import StreetNetwork
from dreamdrive.street_network.weights import Training, read_network, write_network
from dreamdrive_train.street_network.data.drawn import CLASS_OF
from streetworld import make_street

ANSWERS = Path(__file__).with_name("shipped.json")


@pytest.fixture
def weights(tmp_path: Path) -> Path:
    """Weights that nothing was learned for."""
    torch.manual_seed(0)
    path = tmp_path / "random.safetensors"
    write_network(StreetNetwork(), Training(0, 0, "none", {}, {}, "none"), path)
    return path


def test_a_file_of_weights_sees(weights: Path) -> None:
    frames = np.random.default_rng(0).integers(0, 255, (3, 90, 160, 3), np.uint8)
    options = LookOptions(width_px=160, features=True)
    seen = look(frames, weights, options=options)
    assert seen.depth.shape == (3, 90, 160)
    assert seen.features is not None
    assert seen.features.shape[2:] == (11, 20)
    again = look(frames[1:], load_knowledge(weights), options=options)
    assert np.allclose(seen.depth[1:], again.depth, rtol=1e-4)
    assert np.isfinite(seen.depth).all()


def test_missing_weights_are_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shipped, "_FILE", tmp_path / "street.safetensors")
    with pytest.raises(InputError, match="this installation has no weights; give a file of weights"):
        load_knowledge()
    with pytest.raises(InputError, match="there is no such file; expected street, or a file of weights"):
        load_knowledge(tmp_path / "other.safetensors")
    (tmp_path / "text.safetensors").write_text("nothing")
    with pytest.raises(InputError, match="missing or damaged"):
        load_knowledge(tmp_path / "text.safetensors")


def drawn() -> DriveTruth:
    return make_street(0, 1, 1.0, (320, 180), edition=2)


@pytest.fixture(scope="module")
def street() -> DriveTruth:
    return drawn()


def answers(drive: DriveTruth) -> dict[str, list[float]]:
    """Depth and classes on a grid, road users and the camera: what any slip in the network would change."""
    seen = look(drive.frames, options=LookOptions(width_px=320))
    camera = seen.camera
    return {
        "depth": seen.depth[0, 10::20, 10::20].ravel().tolist(),
        "spread": seen.spread[0, 10::20, 10::20].ravel().tolist(),
        "classes": [float((seen.classes == each).mean()) for each in StreetClass],
        "users": [len(seen.road_users[0])],
        "camera": [camera.focal_px, camera.horizon_px, camera.roll_rad, camera.focal_spread],
    }


def test_the_weights_that_ship_answer_as_before(street: DriveTruth) -> None:
    wanted = json.loads(ANSWERS.read_text())
    found = answers(street)
    assert found["classes"] == pytest.approx(wanted["classes"], abs=2e-3)
    assert found["users"] == wanted["users"]
    assert found["camera"] == pytest.approx(wanted["camera"], rel=0.01, abs=1e-3)
    for name in ("depth", "spread"):
        one, other = np.array(found[name]), np.array(wanted[name])
        # Where two classes are as likely, rounding decides.
        assert (np.abs(one - other) <= 0.01 * np.abs(other) + 1e-3).mean() > 0.97


def test_the_weights_that_ship_know_a_street(street: DriveTruth) -> None:
    drive = street
    seen = look(drive.frames)
    true_m, depth, sky = drive.depth_m[0], seen.depth[0], CLASS_OF[drive.semantic[0]] == StreetClass.SKY
    near = (true_m > 2) & (true_m < 80) & (depth > 0)
    ratio = np.log(true_m[near] / depth[near])
    assert np.median(np.abs(ratio - np.median(ratio))) < 0.15
    assert (seen.classes[0][sky] == StreetClass.SKY).mean() > 0.9


def test_the_weights_that_ship_are_small_and_say_what_they_were_trained_on() -> None:
    path = shipped.weights_of()
    assert path.stat().st_size < 12e6
    network, training = read_network(path)
    assert sum(each.numel() for each in network.parameters()) < 6e6
    assert training.data
    assert training.steps > 0
    assert len(training.commit) >= 7
    assert training.licence


if __name__ == "__main__":
    ANSWERS.write_text(json.dumps(answers(drawn()), indent=1) + "\n")
