"""Does a scene follow its layout? One box moved by 2 m, or the road's edge by 0.5 m, and all else the same.

    python benchmarks/control.py [--quick] [--seeds S ...] [--runs runs/control] [--json FILE]

Every seed gives a street; it is generated once as drawn and once for each change, with the same seed. For a
moving vehicle (one that the first scene finds, if any) and for a parked one its Gaussians in the first
scene (the dynamic ones that show it, or, parked, all that do) are moved along the change until the first
scene looks most like the second; that nothing else tells where it is now, so that a scene in which it has
not moved gives 0 m, and one in which it is not there nothing. For the road's edge (straight streets: seeds
that 3 divides) it is the edge at which a clean drawing of the world is most like the changed scene. PSNR
compares the renders of both scenes where the change is not: outside the vehicle's masks in both worlds and
whatever else differs between the worlds' clean frames (shadows, the strip beside the edge), widened by 8
px. --geometry true hands exact poses and depth over.
"""

import sys

from control.main import main

if __name__ == "__main__":
    sys.exit(main(__doc__))
