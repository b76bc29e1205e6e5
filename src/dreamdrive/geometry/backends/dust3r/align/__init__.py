"""Global alignment: from pointmaps of pairs to one world (Wang et al. 2024, section 3.4)."""

from dreamdrive.geometry.backends.dust3r.align.aligned import Aligned
from dreamdrive.geometry.backends.dust3r.align.alignment import AlignOptions, Known, align, check_memory
from dreamdrive.geometry.backends.dust3r.align.focal import robust_px
from dreamdrive.geometry.backends.dust3r.align.graph import Graph, graph_of
from dreamdrive.geometry.backends.dust3r.align.spanning_tree import BASE_SCALE, Start
