"""Where commands say things."""

from rich.console import Console


def plain(*, stderr: bool = False) -> Console:
    """A console that prints text as it is: names of files may look like markup, or like an emoji."""
    return Console(stderr=stderr, highlight=False, markup=False, emoji=False, soft_wrap=True)
