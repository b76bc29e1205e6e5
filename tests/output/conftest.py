"""A server that runs commands, and their inputs, once for all tests of this folder."""

import json
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path

import pytest

from tests.conftest import ROOT
from tests.output.server import Call, Came
from tests.output.writers import make_inputs


class Server:
    """Asks the process of ``tests.output.server``."""

    def __init__(self, process: "subprocess.Popen[str]") -> None:
        self._process = process

    def __call__(self, call: Call) -> Came:
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        print(json.dumps(asdict(call)), file=self._process.stdin, flush=True)
        return Came(**json.loads(self._process.stdout.readline()))


@pytest.fixture(scope="session")
def server() -> Iterator[Server]:
    arguments = [sys.executable, "-m", "tests.output.server"]
    with subprocess.Popen(
        arguments, cwd=ROOT, text=True, stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        yield Server(process)
        assert process.stdin is not None
        process.stdin.close()


@pytest.fixture(scope="session")
def inputs(server: Server, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with all that the commands read."""
    folder = tmp_path_factory.mktemp("inputs")
    make_inputs(folder, lambda words: server(Call(words, str(folder))))
    return folder
