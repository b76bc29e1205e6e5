"""``dreamdrive clean``: free what the stages of a finished run hold."""

from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from dreamdrive.files.given import SCENE, check_there
from dreamdrive.files.output import remove
from dreamdrive.files.paths import inside


def clean(out: Annotated[Positional[Path], arg(metavar="OUT")]) -> None:
    """Remove the results that the stages of generate keep in an output folder.

    Scene, videos and report stay. Another generate into the folder computes all stages again.

    Args:
        out: The folder that generate wrote.
    """
    check_there(out, SCENE)
    from dreamdrive.run import check_ours, only_run

    check_ours(out)
    with only_run(out):
        remove(inside(out, "stages"))
