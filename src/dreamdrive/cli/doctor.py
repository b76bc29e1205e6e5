"""``dreamdrive doctor``: what this installation and machine offer, and what is missing."""

import platform

from rich.console import Console
from rich.table import Table

from dreamdrive.cli.machine import available_cores, available_memory_mb, use_all_cores
from dreamdrive.errors import InputError

_NEEDED_MB = 3000
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
    missing = [
        f"{name} is missing: pip install {name}" for name, version in versions.items() if version is None
    ]
    native, trouble = _native()
    table.add_row("native core", native)
    memory_mb = available_memory_mb()
    table.add_row("cores", str(available_cores()))
    table.add_row("free memory", "unknown" if memory_mb is None else f"{memory_mb / 1000:.1f} GB")
    if memory_mb is not None and memory_mb < _NEEDED_MB:
        missing.append(
            f"less than {_NEEDED_MB / 1000:.0f} GB of memory is free: use fewer frames or a smaller --size"
        )
    table.add_row("GPU", _gpu())
    console = Console()
    console.print(table)
    _backends(console)
    missing += trouble
    for line in missing:
        console.print(f"missing: {line}", soft_wrap=True)
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
    """What ``generate --prior`` and ``--geometry`` offer; nothing is needed but what is ready."""
    try:
        from dreamdrive.geometry import BACKENDS
        from dreamdrive.prior import PRIORS
    except ImportError:
        return
    offers = [("prior", each) for each in PRIORS.values()] + [
        ("geometry", each) for each in BACKENDS.values()
    ]
    for stage, backend in offers:
        takes = "ready" if backend.weights is None else f"give --weights, {backend.weights}"
        console.print(f"\n {stage} {backend.name}: {backend.about}", highlight=False, soft_wrap=True)
        for name, value in (
            ("to use it", backend.missing_package() or takes),
            ("memory", backend.memory),
            ("licence", backend.licence),
        ):
            console.print(f"   {name}: {value}", highlight=False, soft_wrap=True)
    console.print()


def _gpu() -> str:
    """Whether Gaussians can be splatted on a GPU, which no command needs."""
    try:
        from dreamdrive.splat import why_unusable
    except ImportError:
        return "unknown without torch and the native core; not needed"
    trouble = why_unusable()
    return "backend gsplat can be used; not needed" if trouble is None else f"not needed; {trouble}"
