"""What is said before a run."""

from pathlib import Path

import pytest

from dreamdrive.prior import NAMED, Choice, auto_prior
from dreamdrive.run.production import _whose_frames


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
