"""Which representation shows a street best from where no camera has been: the paper's Table I with a truth.

    python benchmarks/street.py [--quick] [--seeds S ...] [--workers N] [--resume] [--runs runs/street]
                                [--json FILE] [--markdown FILE] [--picture FILE]
                                [--inception FILE] [--i3d FILE]

Seeded worlds of 24 frames are reconstructed with five representations of motion: static (3D-GS), deformable
(all Gaussians through F_deform, as Deformable-GS and MagicDrive3D), hexplane (as S3Gaussian), vibration (as
PVG) and hybrid (ours). All take the same optimiser steps from the same points and the same static fit; a
second table gives all the seconds of hybrid, timed beside each, a third gives the others five times the
steps. Depth and motion are found by the classical geometry, with true poses, with true intrinsics alone, or
with nothing known; references are clean, or corrupted as generated video is. Every view is compared with
the clean truth. Beside them stand how consistent a rendered drive is with itself and its path, against its
references, and the same five fits of a recorded clip (``DREAMDRIVE_DATA``); at the end, what was asked of
hybrid and what it reached.

Each fit is a scene below ``--runs``, its figures a file; both know the worlds and options they follow from.
With ``--resume`` those that are there and still follow count; with ``--measure-again`` the scenes alone do,
and all figures are taken anew. ``--workers`` makes that many fits side by side, each on its share of the
cores. Seconds are the processor's, so that equal time does not depend on what else the machine does. A fit
that fails is named at the end, and its reason kept beside the others' results.
"""

import sys

from street.main import main

if __name__ == "__main__":
    sys.exit(main(__doc__))
