"""Flags of the kinds of input: which stand first in ``--help``, and what becomes of them."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from dreamdrive.cli.main import main
from dreamdrive.cli.terminal.asked import Asked
from dreamdrive.scene.control import Command, Control

Panels = Callable[..., dict[str, str]]


@pytest.fixture
def panels(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> Panels:
    """The panels of ``--help`` by their titles, with the given words before it, on a usual terminal."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")

    def call(*words: str) -> dict[str, str]:
        monkeypatch.setattr("sys.argv", ["dreamdrive", *words, "--help"])
        with pytest.raises(SystemExit):
            main()
        _, *parts = re.split(r"^ ([a-z][a-z -]+?) +\n -{20,} *$", capsys.readouterr().out, flags=re.MULTILINE)
        return dict(zip(parts[::2], parts[1::2], strict=True))

    return call


def flags_in(panel: str) -> set[str]:
    return set(re.findall(r"^  (?:-\w(?: [A-Z]+)?, )?(--[a-z][a-z-]*)", panel, re.MULTILINE))


def test_without_an_input_the_most_common_options_stand_first_and_short(panels: Panels) -> None:
    found = panels("generate")
    assert list(found)[:3] == ["positional arguments", "options", "recording options"]
    assert {"--out", "--quality"} <= flags_in(found["options"])
    assert {"--frames", "--size", "--hfov"} <= flags_in(found["recording options"])
    assert len(found["recording options"].strip().splitlines()) < 14
    together = [flag for panel in found.values() for flag in flags_in(panel)]
    assert len(together) == len(set(together))


@pytest.mark.parametrize(
    ("words", "title", "taken", "refused"),
    [
        (("clip.mp4",), "replay", "--poses", "--view"),
        (("street.jpg",), "photo", "--fill", "--poses"),
        (("street.jpg", "--prior", "vista"), "vista", "--steps", "--fill"),
        (("street.json",), "street-world", "--scene", "--hfov"),
        (("here", "--dataset", "recording"), "replay", "--dataset", "--scene"),
    ],
)
def test_what_the_input_takes_stands_first(
    panels: Panels, words: tuple[str, ...], title: str, taken: str, refused: str
) -> None:
    found = panels("generate", *words)
    _, second = list(found)[:2]  # behind those of every input
    assert second == f"{title} options"
    first = flags_in(found.pop(second))
    assert taken in first
    assert refused not in first
    assert refused in {flag for panel in found.values() for flag in flags_in(panel)}


def test_an_input_that_cannot_be_changes_nothing(panels: Panels) -> None:
    wrong, usual = panels("generate", "clip.mp4", "--dataset", "rig"), panels("generate")
    assert wrong["recording options"] == usual["recording options"]
    assert "photo options" in panels("prior", "sample", "street.jpg")


def test_what_is_typed_becomes_a_control(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    asked: list[Control] = []

    def noted(self: Asked, path: Path | None, seed: int) -> Control:
        asked.append(whole(self, path, seed))
        raise SystemExit(0)

    whole = Asked.control
    monkeypatch.setattr(Asked, "control", noted)
    words = f"generate {tmp_path} -o o --size 64x48 --view 30,-5 --hfov 60 --traffic-speed 4 --hold-out 8"
    words += f" --poses {tmp_path} --seed 3 --action command=left --action command=stop"
    monkeypatch.setattr("sys.argv", ["dreamdrive", *words.split()])
    with pytest.raises(SystemExit):
        main()
    wanted = Control(
        tmp_path,
        size=(64, 48),
        view=(30.0, -5.0),
        hfov_deg=60.0,
        traffic_speed_m_s=4.0,
        hold_out=8,
        poses=tmp_path,
        seed=3,
        actions=(Command("left"), Command("stop")),
    )
    assert asked == [wanted]
