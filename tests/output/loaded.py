"""Loads all that commands import, and makes fits a handful of steps: what each fork then has already."""

import importlib
import pkgutil

import cv2
import pytest

import dreamdrive
from tests.test_generate import shorten
from tests.test_house import WITH_AN_EXTRA

for _each in pkgutil.walk_packages(dreamdrive.__path__, "dreamdrive."):
    if _each.name not in WITH_AN_EXTRA and not _each.name.endswith("__main__"):
        importlib.import_module(_each.name)

# Threads do not outlive a fork: those of OpenCV would start here, those of torch with the first command.
cv2.setNumThreads(0)
shorten(pytest.MonkeyPatch())
