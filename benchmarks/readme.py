"""All figures of the README, and how far they hold on worlds that no choice was made on.

    python benchmarks/readme.py [--workers N] [--whole-paper] [--no-clips] [--runs runs/readme] [--quick]

Drawn streets first: the worlds kept for tests, with five representations from clean references and hybrid
from corrupted ones, and hybrid on the worlds of the development; intrinsics are known, poses are not. Then
the recorded clips, each through ``dreamdrive generate``; choices were made on all of them, and the tables
call them development clips. ``--whole-paper`` adds methods at the size that their authors give them, on four
test worlds with true poses and equal steps.

The tables replace the sections of ``README.md`` and ``docs/figures.md`` that bear their names, and all rows
go to ``benchmarks/results/readme-DATE.json`` with commit and machine. What is finished is kept below
``--runs``, in a folder a commit, and the same command goes on from there: a long run belongs into a pinned
checkout, see ``pinned.py``. ``--quick`` takes two worlds and one clip, and only prints.
"""

import sys

from readme.main import main

if __name__ == "__main__":
    sys.exit(main(__doc__))
