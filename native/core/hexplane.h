// Planes of features over space and time: laid out for the kernels, shared among the threads by channels.
#pragma once
#include <cstdint>
#include <vector>

#include "buffer.h"
#include "kernels/types.h"

namespace dd {

// Planes of one level as torch keeps them: (3, channels, nodes, nodes), and those with time at a time (3, channels, nodes).
struct PlaneLevel {
  const float *space, *lines;
  int nodes;
};
struct PlaneLevelGradient {
  float *space, *lines;
};

// The levels with neighbouring channels side by side, slice by slice.
class Hexplane {
 public:
  Hexplane(const std::vector<PlaneLevel>& levels, int channels);
  int channels() const { return channels_; }
  const std::vector<PlaneLevel>& levels() const { return levels_; }

  // Features (n, levels * channels) of the points of a task.
  void forward(const PlanesTask& task, int64_t n, float* features) const;
  // Writes gradients; every number of them is a sum over the points in their order.
  void backward(const PlanesTask& task, int64_t n, const float* d_features,
                const std::vector<PlaneLevelGradient>& gradients) const;

 private:
  int64_t slices() const { return int64_t(levels_.size()) * per_level(); }
  int per_level() const { return (channels_ + kPlaneSlice - 1) / kPlaneSlice; }
  PlanesTask slice_of(const PlanesTask& task, int64_t slice) const;
  int64_t first_feature(int64_t slice) const;

  std::vector<PlaneLevel> levels_;
  int channels_;
  std::vector<Floats> space_, lines_;           // of each slice
};

}  // namespace dd
