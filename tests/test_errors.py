"""The error of a user's mistake says the same wherever it is raised again."""

import pickle
from pathlib import Path

import numpy as np
import pytest

from dreamdrive.errors import InputError
from dreamdrive.evaluate.networks.packaged import MissingWeightsError
from dreamdrive.geometry.backends.files.wanted import PosesMissingError
from dreamdrive.run.codec import DamagedError

SRC = Path(__file__).parents[1] / "src"
KINDS = [InputError, MissingWeightsError, PosesMissingError, DamagedError]
TEXTS = ["a.png is no picture; expected one", "\x1b[2J\0" * 10, "a" * 5000]


def test_these_are_all_kinds() -> None:
    found = [
        line
        for path in SRC.rglob("*.py")
        for line in path.read_text().splitlines()
        if line.startswith("class ") and line.endswith("(InputError):")
    ]
    assert len(found) == len(KINDS) - 1


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("text", TEXTS)
def test_other_processes_say_the_same(kind: type[InputError], text: str) -> None:
    """gymnasium makes the error anew of itself, a pool of processes of its pickle."""
    error = kind(text)
    for again in (kind(error), pickle.loads(pickle.dumps(error))):
        assert type(again) is kind
        assert str(again) == str(error)


def test_what_an_error_carries_comes_along() -> None:
    again = pickle.loads(pickle.dumps(PosesMissingError("some have no pose", np.array([1, 3]))))
    assert again.kept.tolist() == [1, 3]
