"""Which prior an input is given to."""

from pathlib import Path

import pytest

from dreamdrive.errors import InputError
from dreamdrive.prior import auto_prior, variable_of

PHOTO, LAYOUT, CLIP = Path("street.jpg"), Path("street/layout.json"), Path("drive.mp4")


@pytest.fixture(autouse=True)
def _nothing_configured(monkeypatch: pytest.MonkeyPatch) -> None:
    for prior in ("vista", "magicdrive"):
        monkeypatch.delenv(variable_of(prior), raising=False)


def test_without_weights_the_input_decides(tmp_path: Path) -> None:
    assert auto_prior(None).name == "replay"
    assert auto_prior(CLIP).name == "replay"
    assert auto_prior(tmp_path).name == "replay"
    assert auto_prior(LAYOUT).name == "street-world"
    choice = auto_prior(PHOTO)
    assert choice.name == "photo"
    assert "no weights of Vista are configured (DREAMDRIVE_VISTA)" in choice.why


def test_weights_that_are_configured_are_used(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DREAMDRIVE_VISTA", "/models/vista")
    monkeypatch.setenv("DREAMDRIVE_MAGICDRIVE", "owner/magicdrive")
    assert auto_prior(PHOTO).name == "vista"
    assert auto_prior(PHOTO).weights == "/models/vista"
    assert auto_prior(LAYOUT).name == "magicdrive"
    assert auto_prior(LAYOUT).weights == "owner/magicdrive"
    assert auto_prior(CLIP).weights is None


def test_weights_without_a_name_are_refused_for_a_photo(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DREAMDRIVE_VISTA", "/models/vista")
    with pytest.raises(InputError, match="--prior NAME"):
        auto_prior(PHOTO, with_weights=True)
    assert auto_prior(LAYOUT, with_weights=True).name == "street-world"
