"""``dreamdrive prior``: networks of the generative priors."""

from importlib.util import find_spec
from pathlib import Path
from typing import Annotated, Any, Literal

from rich.console import Console
from tyro.conf import OmitArgPrefixes, OmitSubcommandPrefixes, Positional, Suppress, arg, subcommand

from dreamdrive.cli.progress import Bars
from dreamdrive.errors import InputError


def convert(
    file: Annotated[Positional[Path], arg(metavar="FILE")],
    folder: Annotated[Positional[Path], arg(metavar="DIR")],
    *,
    dtype: Literal["float16", "float32"] = "float16",
    force: bool = False,
) -> None:
    """Turn the single file of Vista or Stable Video Diffusion into a folder, which loads faster.

    Args:
        file: vista.safetensors or svd_xt.safetensors.
        folder: Folder to write, for --weights.
        dtype: float16 halves the folder and suits a GPU; the autoencoder stays in float32.
        force: Replace a folder that is there already.
    """
    if find_spec("diffusers") is None:
        raise InputError('the package diffusers is missing: pip install "dreamdrive[video-prior]"')
    from dreamdrive.prior.vista.convert import convert as run

    console = Console(highlight=False)
    with Bars(console) as bars:
        made = run(
            file, folder, dtype, replace=force, progress=lambda done, total: bars("convert", done, total)
        )
    kind = made.stored.kind
    console.print(
        f"{folder}: {kind.title}, for --prior {kind.name} --weights {folder}", soft_wrap=True, markup=False
    )
    for what, count in made.ignored.items():
        console.print(f"left out, not needed: {what}, {count} tensors", soft_wrap=True)


# As tyro does for the commands themselves; a union needs a second member where there is one command only.
_Prior = Annotated[Any, subcommand("convert", constructor=convert)] | Annotated[None, Suppress]


def prior(what: Annotated[_Prior, OmitSubcommandPrefixes, OmitArgPrefixes]) -> None:  # pyright: ignore[reportInvalidTypeForm]
    """Networks of the generative priors.

    Args:
        what: What to do.
    """
