"""``python -m dreamdrive``."""

from dreamdrive.cli.main import main

main()
