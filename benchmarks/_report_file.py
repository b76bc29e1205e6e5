"""Where reports go."""

from pathlib import Path


def write(path: Path | None, text: str) -> None:
    """A report, if it is wanted; its folder is made."""
    if path is not None:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
