from pathlib import Path

import pytest

from dreamdrive.errors import InputError
from dreamdrive.models.weights import cache, find_weights

NAME, COMMIT = "naver/DUSt3R_ViTLarge_BaseDecoder_512_dpt", "ab12"


@pytest.fixture
def hub(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("HF_HUB_CACHE", str(tmp_path / "hub"))
    return tmp_path / "hub"


def snapshot(hub: Path) -> Path:
    model = hub / "models--naver--DUSt3R_ViTLarge_BaseDecoder_512_dpt"
    folder = model / "snapshots" / COMMIT
    folder.mkdir(parents=True)
    (model / "refs").mkdir()
    (model / "refs" / "main").write_text(COMMIT)
    return folder


def test_a_path_is_itself(tmp_path: Path, hub: Path):
    path = tmp_path / "some.pth"
    path.touch()
    assert find_weights(path) == path
    assert find_weights(str(tmp_path)) == tmp_path


def test_a_cached_model_is_found_by_name(hub: Path):
    folder = snapshot(hub)
    assert find_weights(NAME) == folder


def test_what_is_not_there_is_not_fetched_but_named(hub: Path):
    with pytest.raises(InputError, match=f"hf download {NAME}"):
        find_weights(NAME)
    with pytest.raises(InputError, match=r"weights/some\.pth does not exist"):
        find_weights("weights/some.pth")
    with pytest.raises(InputError, match="/none does not exist"):
        find_weights("/none")


def test_a_model_half_downloaded_is_not_there(hub: Path):
    snapshot(hub).rmdir()
    with pytest.raises(InputError, match="neither a path nor a model"):
        find_weights(NAME)


def test_the_cache_is_where_the_hub_keeps_it(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    monkeypatch.delenv("HF_HUB_CACHE", raising=False)
    monkeypatch.setenv("HF_HOME", str(tmp_path))
    assert cache() == tmp_path / "hub"
    monkeypatch.delenv("HF_HOME")
    assert cache() == Path.home() / ".cache" / "huggingface" / "hub"
