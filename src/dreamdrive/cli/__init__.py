"""The command line: one module a command, each a thin call of the API."""

from typing import TYPE_CHECKING

from dreamdrive.registry import offer

if TYPE_CHECKING:
    from dreamdrive.cli.terminal.arguments import parse_actions as parse_actions

__all__ = offer(__name__)  # pyright: ignore[reportUnsupportedDunderAll]
