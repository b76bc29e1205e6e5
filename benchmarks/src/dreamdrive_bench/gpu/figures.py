"""Figures of one part, on disk as soon as they are there, and what failed among them."""

import time
import traceback
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import torch

from dreamdrive_bench.common.report import as_json, write

_LINES = 6
"""Last lines of an error that are kept."""


@dataclass
class Figures:
    """What a part measured until now; every change is written to ``path``.

    ``device`` is where the part computes, and ``pretended`` says that everything is tiny.
    """

    path: Path
    device: torch.device
    pretended: bool = False
    values: dict[str, Any] = field(default_factory=dict)

    def put(self, *keys_and_value: Any) -> None:
        """Keep a value under one or several keys, outer first."""
        *keys, value = keys_and_value
        at = self.values
        for key in keys[:-1]:
            at = at.setdefault(key, {})
        at[keys[-1]] = value
        print(*keys, value, flush=True)
        write(self.path, as_json(self.values))

    @contextmanager
    def attempt(self, name: str) -> Generator[None, None, None]:
        """Work that may fail: what it raised is kept, and the part goes on."""
        try:
            yield
        except Exception:  # noqa: BLE001  whatever it is, the other figures are wanted
            said = traceback.format_exc().strip().splitlines()[-_LINES:]
            self.values.setdefault("failed", {})[name] = said
            print(name, *said, sep="\n", flush=True)
            write(self.path, as_json(self.values))
        finally:
            if self.device.type == "cuda":
                torch.cuda.empty_cache()

    def timed(self, run: Callable[[], Any], *, again: int = 1, first: bool = True) -> dict[str, Any]:
        """Seconds of the first run, unless it is left out, and of the median later one; peak memory in GB."""
        self._settle()
        if self.device.type == "cuda":
            torch.cuda.reset_peak_memory_stats()
        taken: list[float] = []
        for _ in range(again + first):
            begin = time.perf_counter()
            run()
            self._settle()
            taken.append(time.perf_counter() - begin)
        told: dict[str, Any] = {"first_s": taken[0]} if first else {}
        if later := sorted(taken[first:]):
            told["seconds"] = later[len(later) // 2]
        return told | self.memory()

    def memory(self) -> dict[str, float]:
        """The most that was allocated and reserved on the GPU since it was last reset, in GB."""
        if self.device.type != "cuda":
            return {}
        return {
            "allocated_gb": torch.cuda.max_memory_allocated() / 1e9,
            "reserved_gb": torch.cuda.max_memory_reserved() / 1e9,
        }

    def _settle(self) -> None:
        if self.device.type == "cuda":
            torch.cuda.synchronize()
