"""Changes of a scene's actors that can be told, kept, taken back and made again."""

from typing import TYPE_CHECKING

from dreamdrive.registry import offer

if TYPE_CHECKING:
    from dreamdrive.edit.edits import (
        Copy as Copy,
        Delay as Delay,
        Edit as Edit,
        Insert as Insert,
        Move as Move,
        Recolour as Recolour,
        Remove as Remove,
        Speed as Speed,
        Turn as Turn,
        edited as edited,
    )
    from dreamdrive.edit.edits_file import (
        EDITS as EDITS,
        Edits as Edits,
        read_edits as read_edits,
        write_edited as write_edited,
    )
    from dreamdrive.edit.insert import (
        SetPlace as SetPlace,
        digest_of_scene as digest_of_scene,
        inserted as inserted,
    )

__all__ = offer(__name__)  # pyright: ignore[reportUnsupportedDunderAll]
