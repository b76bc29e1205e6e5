"""The one error a user's own mistake raises, and what installs a package that is missing."""

PIP = ".venv/bin/pip install"
"""What installs packages, in the clone that dreamdrive runs from."""
_LONGEST, _HEAD, _TAIL = 1000, 500, 400


class InputError(ValueError):
    """Something the user gave cannot be used; the text says what was got, what was expected and what to do.

    The command line prints the text alone and exits with code 2. What it quotes from files may be long and
    hold anything: the middle of a long text is left out, and what would move a terminal's cursor is escaped.
    Other processes send one as its text or make it anew of itself; both give the same again.
    """

    def __init__(self, text: object) -> None:
        whole = "".join(each if each.isprintable() else repr(each)[1:-1] for each in str(text))
        super().__init__(whole if len(whole) <= _LONGEST else f"{whole[:_HEAD]} ... {whole[-_TAIL:]}")


def installing(extra: str) -> str:
    """What installs an extra of ``pyproject.toml``."""
    return f"in dreamdrive's folder: {PIP} -e '.[{extra}]'"
