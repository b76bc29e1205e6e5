"""Argoverse 2: sensor logs with boxes on tracks and a vector map, without their pictures."""

from dreamdrive.datasets.argoverse.log import is_argoverse, read_argoverse
