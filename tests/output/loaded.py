"""Loads all that commands import, and makes fits a handful of steps: what each fork then has already."""

import importlib
import pkgutil

import av.logging  # noqa: F401
import cv2
import pycolmap  # noqa: F401
import pytest
import torch._dynamo  # noqa: F401  # imported by every optimiser
import tyro.extras  # noqa: F401
from PIL import Image

import dreamdrive
import dreamdrive_train
import streetworld
from tests.test_generate import shorten
from tests.test_house import WITH_AN_EXTRA

for _package in (dreamdrive, dreamdrive_train, streetworld):
    for _each in pkgutil.walk_packages(_package.__path__, f"{_package.__name__}."):
        if _each.name not in WITH_AN_EXTRA and not _each.name.endswith("__main__"):
            importlib.import_module(_each.name)

# Threads do not outlive a fork: those of OpenCV would start here, those of torch with the first command.
cv2.setNumThreads(0)
Image.init()
shorten(pytest.MonkeyPatch())
