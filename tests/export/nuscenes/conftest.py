"""A folder of nuScenes, as readers are tested with."""

from tests.datasets.nuscenes.conftest import change as change, folder as folder
