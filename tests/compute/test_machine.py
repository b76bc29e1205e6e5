"""What a machine offers, by what its containers and limits leave."""

import resource
import subprocess
import sys
from pathlib import Path

import pytest
import torch

from dreamdrive.compute import machine

GB = 10**9


@pytest.fixture
def tell(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Write files as a kernel would; ``/proc`` and ``/sys/fs/cgroup`` by relative names."""
    monkeypatch.setattr(machine, "_PROC", tmp_path / "proc")
    monkeypatch.setattr(machine, "_CGROUPS", tmp_path / "cgroup")

    def write(**files: str) -> None:
        for name, text in files.items():
            path = tmp_path / name.replace("__", "/").replace("_dot_", ".")
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)

    write(proc__meminfo=f"MemTotal: 1 kB\nMemAvailable: {8 * GB // 1024} kB\n")
    return write


def test_without_containers_the_machine_counts(tell) -> None:
    assert machine.free_bytes() == 8 * GB // 1024 * 1024
    assert machine.available_cores() >= 1


def test_a_container_of_version_2_leaves_what_its_group_and_those_around_it_leave(tell) -> None:
    tell(
        proc__self__cgroup="0::/outer/inner\n",
        cgroup__outer__memory_dot_max=f"{3 * GB}\n",
        cgroup__outer__memory_dot_current=f"{2 * GB}\n",
        cgroup__outer__memory_dot_stat=f"anon {GB}\ninactive_file {GB // 2}\n",
        cgroup__outer__inner__memory_dot_max="max\n",
        cgroup__outer__inner__memory_dot_current="5\n",
    )
    assert machine.free_bytes() == 3 * GB - 2 * GB + GB // 2
    tell(cgroup__outer__inner__cpu_dot_max="100000 100000\n", cgroup__outer__cpu_dot_max="max 100000\n")
    assert machine.available_cores() == 1


def test_a_container_that_sees_only_its_own_root_is_found(tell) -> None:
    tell(
        proc__self__cgroup="0::/somewhere/outside\n",
        cgroup__memory_dot_max=f"{GB}\n",
        cgroup__memory_dot_current="0\n",
        cgroup__cpu_dot_max="50000 100000\n",
    )
    assert machine.free_bytes() == GB
    assert machine.available_cores() == 1


def test_a_container_of_version_1_counts_too(tell) -> None:
    tell(
        proc__self__cgroup="4:memory:/a\n3:cpu,cpuacct:/a\n",
        cgroup__memory__a__memory_dot_limit_in_bytes=f"{GB}\n",
        cgroup__memory__a__memory_dot_usage_in_bytes=f"{GB // 4}\n",
    )
    tell(**{"cgroup__cpu,cpuacct__a__cpu_dot_cfs_quota_us": "-1\n"})
    tell(**{"cgroup__cpu,cpuacct__a__cpu_dot_cfs_period_us": "100000\n"})
    assert machine.free_bytes() == GB - GB // 4
    assert machine.available_cores() == len(machine.os.sched_getaffinity(0))


@pytest.mark.parametrize("text", ["", "x", "0::", "9:memory", "0::/../..", "\n\n"])
def test_what_a_kernel_never_says_is_no_limit(tell, text: str) -> None:
    tell(proc__self__cgroup=text, cgroup__memory_dot_max="?", cgroup__cpu_dot_max="a b")
    assert machine.free_bytes() == 8 * GB // 1024 * 1024
    assert machine.available_cores() >= 1


def test_the_limit_of_address_space_counts() -> None:
    code = "from dreamdrive.compute.machine import free_bytes; print(free_bytes())"
    done = subprocess.run(
        [sys.executable, "-c", code],
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (GB, GB)),
        capture_output=True,
        text=True,
        check=True,
    )
    assert 0 < int(done.stdout) < GB


def test_what_torch_holds_of_a_gpu_without_using_it_is_free(monkeypatch: pytest.MonkeyPatch) -> None:
    told = {"mem_get_info": (3 * GB, 9 * GB), "memory_reserved": 5 * GB, "memory_allocated": 4 * GB}
    for name, value in told.items():
        monkeypatch.setattr(f"torch.cuda.{name}", lambda device, value=value: value)
    assert machine.free_bytes(torch.device("cuda")) == 4 * GB
