// A slice of a hexplane at many points: bilinear between nodes, the product over the planes, and the gradients. How steep
// a plane is.
#include "kernel_list.h"
#include "lanes.h"

namespace dd::DD_ISA {
namespace {

using W = float __attribute__((vector_size(4 * kPlaneSlice)));

static inline W node(const float* p) {
  W v;
  __builtin_memcpy(&v, p, sizeof(v));
  return v;
}
static inline void add(float* p, W v) {
  v += node(p);
  __builtin_memcpy(p, &v, sizeof(v));
}

// Where a point lies between the nodes of each axis; beyond the box on its border.
struct Place {
  int64_t cell[3];
  float share[3];                               // of the node behind
  Place(const PlanesTask& task, int64_t point) {
    for (int k = 0; k < 3; k++) {
      const float at = (task.means[3 * point + k] - task.low[k]) / (task.high[k] - task.low[k]) * float(task.nodes - 1);
      const float inside = at > 0.0f ? (at < float(task.nodes - 1) ? at : float(task.nodes - 1)) : 0.0f;
      const int cut = int(inside);
      cell[k] = cut < task.nodes - 2 ? cut : task.nodes - 2;
      share[k] = inside - float(cell[k]);
    }
  }
};

// The corners of a cell of a plane of space, their weights, and two nodes of a line.
struct Cell {
  int64_t at, below;                            // floats to the first corner, and from a row to the next
  float weight[4];
};
static inline Cell cell_of(const PlanesTask& task, const Place& place, int plane) {
  const int across = plane == 2 ? 1 : 0, down = plane == 0 ? 1 : 2;
  const float u = place.share[across], v = place.share[down];
  const int64_t row = int64_t(task.nodes) * kPlaneSlice;
  return {plane * task.nodes * row + place.cell[down] * row + place.cell[across] * kPlaneSlice,
          row,
          {(1 - u) * (1 - v), u * (1 - v), (1 - u) * v, u * v}};
}
static inline int64_t line_at(const PlanesTask& task, const Place& place, int axis) {
  return (axis * task.nodes + place.cell[axis]) * kPlaneSlice;
}

// What the six planes hold at a place.
static inline void sample(const PlanesTask& task, const Place& place, W (&six)[6]) {
  for (int plane = 0; plane < 3; plane++) {
    const Cell c = cell_of(task, place, plane);
    const float *top = task.space + c.at, *bottom = top + c.below;
    six[plane] = (node(top) * c.weight[0] + node(top + kPlaneSlice) * c.weight[1]) +
                 (node(bottom) * c.weight[2] + node(bottom + kPlaneSlice) * c.weight[3]);
    const float *line = task.lines + line_at(task, place, plane), share = place.share[plane];
    six[3 + plane] = node(line) * (1 - share) + node(line + kPlaneSlice) * share;
  }
}

}  // namespace

void planes(const PlanesTask& task) {
  for (int64_t i = task.first; i < task.last; i++) {
    W six[6];
    sample(task, Place(task, i), six);
    const W product = ((six[0] * six[1]) * (six[2] * six[3])) * (six[4] * six[5]);
    __builtin_memcpy(task.features + i * task.row, &product, sizeof(float) * task.channels);
  }
}

void planes_backward(const PlanesTask& task) {
  for (int64_t i = task.first; i < task.last; i++) {
    const Place place(task, i);
    W six[6], before[6], behind = {};
    __builtin_memcpy(&behind, task.d_features + i * task.row, sizeof(float) * task.channels);
    sample(task, place, six);
    before[0] = W{} + 1.0f;
    for (int k = 1; k < 6; k++) before[k] = before[k - 1] * six[k - 1];
    for (int k = 5; k >= 0; k--) {
      const W gradient = before[k] * behind;
      behind *= six[k];
      if (k < 3) {
        const Cell c = cell_of(task, place, k);
        float *top = task.d_space + c.at, *bottom = top + c.below;
        add(top, gradient * c.weight[0]);
        add(top + kPlaneSlice, gradient * c.weight[1]);
        add(bottom, gradient * c.weight[2]);
        add(bottom + kPlaneSlice, gradient * c.weight[3]);
      } else {
        float *line = task.d_lines + line_at(task, place, k - 3), share = place.share[k - 3];
        add(line, gradient * (1 - share));
        add(line + kPlaneSlice, gradient * share);
      }
    }
  }
}

void steepness(const SteepnessTask& task) {
  const int nodes = task.nodes, size = steepness_row(nodes);
  // Differences from the row above, to the row below, and to the next column behind a zero for the first one.
  float *above = task.scratch, *below = above + size, *beside = below + size;
  for (int i = 0; i < nodes; i++) {
    const float* row = task.image + int64_t(i) * nodes;
    for (int j = 0; j < nodes; j++) below[j] = i + 1 < nodes ? row[nodes + j] - row[j] : 0.0f;
    for (int j = 0; j + 1 < nodes; j++) beside[j + 1] = row[j + 1] - row[j];
    V sum = V{};
    for (int j = 0; j < size; j += kLanes) {
      const V down = load(below + j), right = load(beside + j);
      sum += down * down + right * right;
    }
    *task.sum += double(sum_lanes(sum));
    float* to = task.d_image + int64_t(i) * nodes;
    for (int j = 0; task.d_image && j < nodes; j++)
      to[j] = 2 * task.by_sum * ((above[j] - below[j]) + (beside[j] - beside[j + 1]));
    float* swapped = above;
    above = below;
    below = swapped;
  }
}

}  // namespace dd::DD_ISA
