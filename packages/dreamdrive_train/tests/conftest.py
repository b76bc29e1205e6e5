"""What tests share with those of dreamdrive."""

from tests.cli.conftest import run as run
from tests.conftest import bench_dir as bench_dir, data_dir as data_dir
