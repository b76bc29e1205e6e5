"""Recorded drives with the street network, without it, and beside blending neighbours: the first table.

    python benchmarks/drives.py [NAME ...] [--knowledge twin none street] [--quality draft] [--workers 2]
                                [--runs runs/drives] [--json FILE] [--markdown FILE]

Every drive of ``drives/list.json`` whose recording is there (``drives/bring.py`` brings most) becomes a scene
from its frames alone: held-out frames beside flow interpolation between their neighbours, path error, depth
on lidar and the mask of what moves where the truth is known, what fell back, seconds. A change of geometry is
judged by this table before any other. The same command goes on where it stopped; what another program
measured is measured again. ``runs/drives/NAME-KNOWLEDGE.png`` shows each: recorded, rendered, 2 m aside, what
moves, depth.
"""

import sys

from drives.main import main

if __name__ == "__main__":
    sys.exit(main(__doc__))
