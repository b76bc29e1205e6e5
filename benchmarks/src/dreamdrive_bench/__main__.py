"""``python -m dreamdrive_bench NAME ...``."""

import sys

from dreamdrive_bench.commands import main

if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
