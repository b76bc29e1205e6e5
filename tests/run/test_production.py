"""What is said before a run."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from dreamdrive.errors import InputError
from dreamdrive.options import QUALITIES
from dreamdrive.prior import NAMED, Choice, auto_prior
from dreamdrive.run import open_workspace, production, request_of, start
from dreamdrive.run.production import _whose_frames
from dreamdrive.scene.control import Control


def test_where_the_frames_come_from_is_said_in_a_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("DREAMDRIVE_VISTA", raising=False)
    assert _whose_frames(auto_prior(Path("drive.mp4"))) == "The frames are those of the recording."
    assert _whose_frames(auto_prior(Path("photo.jpg"))) == (
        "The frames come from the prior photo: a photo becomes a street in layers, by the street network, "
        "and is driven into. It was chosen as no weights of Vista are configured (DREAMDRIVE_VISTA)."
    )
    assert _whose_frames(Choice("photo", NAMED)).endswith("and is driven into.")
    monkeypatch.setenv("DREAMDRIVE_VISTA", "vista.safetensors")
    assert _whose_frames(auto_prior(Path("photo.jpg"))).endswith(
        "It was chosen as DREAMDRIVE_VISTA tells where its weights are."
    )


def test_what_a_gpu_has_to_hold_is_said_and_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    frames = tmp_path / "frames"
    frames.mkdir()
    for i in range(6):
        cv2.imwrite(str(frames / f"{i}.png"), np.full((90, 160, 3), 40 * i, np.uint8))
    options = replace(QUALITIES["draft"], device="cuda")
    request = request_of(Control(frames, size=(160, 90)), options=options)
    workspace = open_workspace(tmp_path / "out", request.document)
    assert workspace is not None
    free, said = {"cuda": 10**9}, list[str]()
    monkeypatch.setattr(production, "free_bytes", lambda *device: free[device[0].type] if device else 10**11)
    start(workspace, request, None, lambda stage, done, total: None, said.append)
    assert said[1:] == ["6 frames at 160x90 take at least 0.1 GB of the GPU, with about 8,600 Gaussians"]
    free["cuda"] = 10**6
    with pytest.raises(InputError, match=r"a fit of at least 8,\d+ Gaussians to 6 frames at 160x90 needs"):
        start(workspace, request, None, lambda stage, done, total: None, said.append)
    assert len(said) == 3  # whose the frames are, again
