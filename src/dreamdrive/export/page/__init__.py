"""A scene as one page that plays it in a browser, without any network."""

from typing import TYPE_CHECKING

from dreamdrive.registry import offer

if TYPE_CHECKING:
    from dreamdrive.export.page.page import (
        left_out_of_page as left_out_of_page,
        scene_to_page as scene_to_page,
    )

__all__ = offer(__name__)  # pyright: ignore[reportUnsupportedDunderAll]
