"""The least time each stage of the splat can take: its operations and bytes over the peaks of the machine.

Arithmetic is counted as written in the formulas, one for each addition, product, quotient or root;
comparisons, selections, index arithmetic and exponentials (which have a peak of their own) are not in it.
Bytes are those that must come from or go to memory once; what a stage reads again is taken to be in a cache.
"""

from dataclasses import dataclass

# Operations of one Gaussian: quaternion to matrix 43, camera 18, Jacobian 23, footprint 36, covariance and
# determinant 35, centre 6, conic and reach 33; colour of degree 0.
PROJECT, COLOUR = 194, 6
# The projection again, without conic and reach; footprint 144, quaternion 67, camera 60, mean and colour 24.
PROJECT_BACKWARD = 161 + 295
# Of one pixel in a row of lanes: exponent of alpha 4, transmittance 2, colour and depth 8.
COMPOSITE = 14
# Exponent 4, transmittance rebuilt 4, light by upstream gradient 5, colour sums 6, alpha's gradient 6, its
# six moments 11.
COMPOSITE_BACKWARD = 36
MOMENTS = 9  # sums kept of each entry: six of alpha's gradient, three of the colour
TILE_ENTRY = 12  # the ellipse's extent within one row of tiles

PARAMETERS = 4 * (3 + 4 + 3 + 1)  # bytes of mean, quaternion, scale and opacity
COLOUR_BYTES = 12
SPLAT = 64  # a projected Gaussian
KEY = 8
INDEX = 4
MOMENT_BYTES = 4 * MOMENTS

FORWARD = ("project", "sort", "tiles", "composite")
STAGES = (*FORWARD, "composite_backward", "project_backward")


@dataclass(frozen=True)
class Cost:
    """Operations, exponentials and bytes of a stage."""

    flops: float
    exponentials: float
    moved: float

    def floor_s(self, peaks: dict[str, float]) -> dict[str, float]:
        """Seconds that each of them takes at least."""
        cores = peaks["threads"]
        return {
            "arithmetic": self.flops / (1e9 * peaks["fma_gflops_per_core"] * cores),
            "exponentials": self.exponentials / (1e9 * peaks["exp_g_per_core"] * cores),
            "memory": self.moved / (1e9 * peaks["copy_gb_per_s"]),
        }


def costs(work: dict[str, int], gaussians: int, pixels: int) -> dict[str, Cost]:
    """Cost of each stage from the counts of work.cpp."""
    in_view, entries, reached = work["in_view"], work["entries"], work["reached"]
    lanes = work["rows"] * work["lanes"]
    outputs = PARAMETERS + COLOUR_BYTES
    return {
        "project": Cost(
            gaussians * PROJECT + in_view * COLOUR,
            0,
            gaussians * PARAMETERS + in_view * (COLOUR_BYTES + SPLAT + KEY),
        ),
        # Three passes of a radix sort over the keys; the splats are read and written in depth order.
        "sort": Cost(0, 0, in_view * (3 * 2 * KEY + 2 * SPLAT)),
        # Each entry's tile is written and read again, then its place in the list and back.
        "tiles": Cost(entries * TILE_ENTRY, 0, in_view * SPLAT + entries * 4 * INDEX),
        # Image, depth, alpha; transmittance and last entry for the backward pass.
        "composite": Cost(lanes * COMPOSITE, lanes, in_view * SPLAT + reached * INDEX + pixels * (20 + 8)),
        "composite_backward": Cost(
            lanes * COMPOSITE_BACKWARD + reached * MOMENTS * (work["lanes"] - 1),
            lanes,
            in_view * SPLAT + reached * (INDEX + MOMENT_BYTES) + pixels * (12 + 8),
        ),
        "project_backward": Cost(
            in_view * PROJECT_BACKWARD + reached * MOMENTS,
            0,
            reached * (INDEX + MOMENT_BYTES) + in_view * (PARAMETERS + COLOUR_BYTES) + gaussians * outputs,
        ),
    }


def roofline(
    work: dict[str, int], gaussians: int, pixels: int, peaks: dict[str, float], stages_s: dict[str, float]
) -> list[dict[str, object]]:
    """A row for each stage: measured and least milliseconds, what bounds it, least over measured."""
    rows = []
    for stage, cost in costs(work, gaussians, pixels).items():
        floors = cost.floor_s(peaks)
        bound = max(floors, key=lambda name: floors[name])
        row = {"stage": stage, "ms": 1e3 * stages_s[stage], "floor_ms": 1e3 * floors[bound], "bound": bound}
        rows.append(row | {"share": row["floor_ms"] / row["ms"]})
    return rows


def least_ms(rows: list[dict[str, object]], stages: tuple[str, ...]) -> float:
    """The least time of several stages together."""
    return sum(row["floor_ms"] for row in rows if row["stage"] in stages)
