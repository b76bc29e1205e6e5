// What the kernels that find depth exchange, see types.h.
#pragma once
#include <cstdint>

namespace dd {

// A picture laid over the reference as if all it shows were on one plane after the other, one for each label.
struct SweepSource {
  const float* grey;                            // (h, w)
  const float* usable;                          // (h, w), 1 or 0; null where all pixels are
  const double* homographies;                   // (labels, 3, 3), from pixel indices of the reference to its own
};

struct SweepTask {
  int height, width, labels, n_sources;
  const SweepSource* sources;
  float least_z;                                // what is no farther in front of the source is not seen
  const float* grey;                            // (h, w) of the reference, less `centre` for the cost
  float* out;
  float* scratch;
  // Of the cost alone.
  const float *mean, *variance;                 // (h, w) of the reference over the window
  int side;                                     // of the window, odd, up to kMostSide
  float centre, noise;                          // taken from grey levels, added to both variances
  // Of the misfit alone.
  float most;                                   // grey levels: differences that are larger, or not seen
};
constexpr int kMostSide = 127;
// Floats of a row over which the window may reach at both ends, rounded up so that whole lanes may be read past the end.
static inline int sweep_row(int width, int side) { return (width + side - 1 + 31) / 16 * 16; }
static inline int64_t sweep_scratch(int width, int side, int n_sources) {
  return int64_t(sweep_row(width, side)) * (6 + 4 * side * n_sources);
}

// Semi-global smoothing of a volume of costs.
struct SmoothTask {
  int height, width, labels;
  const float* cost;                            // (h, labels, w)
  const float *jump_down, *jump_right;          // (h - 1, w), (h, w - 1): cost of any change between two pixels
  float step;                                   // cost of a change by one label
  float* total;                                 // (h, labels, w), for the paths down
  float* label;                                 // (h, w), the cheapest one, refined by a parabola
  float* scratch;
};
static inline int padded_labels(int labels) { return (labels + 15) / 16 * 16; }
static inline int64_t smooth_scratch(int width, int labels) {
  return int64_t(width) * (2 * labels + 3 * padded_labels(labels) + 2) + 2 * (padded_labels(labels) + 32);
}

// The least of the values of each column that, with all that are no greater, has half of the weight.
struct MedianTask {
  const float *values, *weights;                // (count, columns)
  int count;
  int64_t columns;
  float* out;                                   // (columns)
  float* scratch;                               // 2 * 16 * count
};

}  // namespace dd
