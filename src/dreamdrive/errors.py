"""The one error a user's own mistake raises."""


class InputError(ValueError):
    """Something the user gave cannot be used; the text says what was got, what was expected and what to do.

    The command line prints the text alone and exits with code 2.
    """
