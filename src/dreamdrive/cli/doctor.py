"""``dreamdrive doctor``: what this installation and machine offer, and what is missing."""

import platform
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from dreamdrive.cli.terminal.console import plain
from dreamdrive.cli.terminal.machine import use_all_cores
from dreamdrive.compute.machine import available_cores, free_bytes
from dreamdrive.data.table import DATASETS
from dreamdrive.errors import PIP, InputError
from dreamdrive.export import EXPORTS
from dreamdrive.geometry import BACKENDS
from dreamdrive.prior import PRIORS

if TYPE_CHECKING:
    from dreamdrive.data import DataSet
    from dreamdrive.export import Export
    from dreamdrive.models import Backend

_NEEDED_BYTES = 3e9
"""Free memory with which 24 frames at 480x270 fit."""


def doctor() -> None:
    """Show versions, instruction set, threads and memory, and say what is missing and how to get it."""
    from dreamdrive import __version__
    from dreamdrive.run import package_versions

    table = Table(show_header=False, box=None)
    table.add_row("dreamdrive", __version__)
    table.add_row("python", f"{platform.python_version()} on {platform.system()} {platform.machine()}")
    versions = package_versions()
    for name, version in versions.items():
        table.add_row(name, version or "missing")
    missing = [f"{name} is missing: {PIP} {name}" for name, version in versions.items() if version is None]
    native, trouble = _native()
    table.add_row("native core", native)
    free = free_bytes()
    table.add_row("cores", str(available_cores()))
    table.add_row("free memory", "unknown" if free is None else f"{free / 1e9:.1f} GB")
    if free is not None and free < _NEEDED_BYTES:
        missing.append(
            f"less than {_NEEDED_BYTES / 1e9:.0f} GB of memory is free: use fewer frames or a smaller --size"
        )
    table.add_row("GPU", _gpu())
    console = plain()
    console.print(table, soft_wrap=False)
    _backends(console)
    missing += trouble
    for line in missing:
        console.print(f"missing: {line}")
    if missing:
        raise InputError(f"{len(missing)} thing{'s are' if len(missing) > 1 else ' is'} missing, see above")
    console.print("everything that generate needs is there")


def _native() -> tuple[str, list[str]]:
    """What the compiled core says of itself, and what is wrong with it."""
    try:
        from dreamdrive.splat import native_info
    except ImportError as error:
        return "missing", [f"the native core cannot be loaded ({error}): run make install, which compiles it"]
    use_all_cores()
    return ", ".join(f"{name} {value}" for name, value in native_info().items()), []


def _backends(console: Console) -> None:
    """What ``generate`` offers by name; nothing of it is needed."""
    tables = {"prior": PRIORS, "geometry": BACKENDS, "data set": DATASETS, "export": EXPORTS}
    for what, table in tables.items():
        for name in table:
            try:
                lines = _about(table[name])
                lines += [f"package: {package} {version}" for package, version in table.package(name).items()]
            except InputError as error:
                lines = ["cannot be used", str(error)]
            except ImportError:
                return  # what dreamdrive itself needs is missing, which is told below
            console.print(f"\n {what} {name}: {lines[0]}")
            for line in lines[1:]:
                console.print(f"   {line}")
    _choices(console)
    console.print()


def _choices(console: Console) -> None:
    """Which prior an input is given to where none is named."""
    from dreamdrive.prior import auto_prior

    console.print("\n without --prior")
    for what, path in (
        ("a recording", None),
        ("a photo", Path("photo.jpg")),
        ("a layout", Path("layout.json")),
    ):
        choice = auto_prior(path)
        console.print(f"   {what}: {choice.name}, as {choice.why}")


def _about(entry: "Backend | DataSet | Export") -> list[str]:
    """What an entry is, and what it takes to use it, a line each."""
    from dreamdrive.data import DataSet
    from dreamdrive.export import Export

    if isinstance(entry, DataSet | Export):
        return [entry.about]
    takes = "ready" if entry.weights is None else f"give --weights, {entry.weights}"
    to_use = entry.missing_package() or takes
    return [entry.about, f"to use it: {to_use}", f"memory: {entry.memory}", f"licence: {entry.licence}"]


def _gpu() -> str:
    """Whether Gaussians can be splatted on a GPU, which no command needs."""
    try:
        from dreamdrive.splat import why_unusable
    except ImportError:
        return "unknown without torch and the native core; not needed"
    trouble = why_unusable()
    return f"backend gsplat can be used; {_held_by_gpu()}" if trouble is None else f"not needed; {trouble}"


def _held_by_gpu() -> str:
    """What a fit of the paper's size may have on the GPU that is there."""
    import torch

    from dreamdrive.fit import FitSize, most_gaussians

    size, free = FitSize(0, 0, 6 * 24, (1600, 900), cameras=6), free_bytes(torch.device("cuda"))
    if free is None:
        return "not needed"
    most = most_gaussians(size, free)
    return (
        f"not needed; {free / 1e9:.1f} GB are free, for about {most / 1e6:.1f} million Gaussians with 24 "
        "frames of each of six cameras at 1600x900"
    )
