#include "hexplane.h"

#include <algorithm>

#include "threads.h"

namespace dd {
namespace {

constexpr int64_t kPlanePoints = 4096;  // of one task

// From (3, all, nodes) channels [first, first + count) to (3, nodes, kPlaneSlice).
Floats packed(const float* planes, int64_t nodes, int all, int first, int count) {
  Floats out(3 * nodes * kPlaneSlice, 0.0f);
  for (int64_t plane = 0; plane < 3; plane++) {
    const float* from = planes + (plane * all + first) * nodes;
    float* to = out.data() + plane * nodes * kPlaneSlice;
    for (int64_t i = 0; i < nodes; i++)
      for (int c = 0; c < count; c++) to[i * kPlaneSlice + c] = from[c * nodes + i];
  }
  return out;
}

void unpack(const Floats& slices, int64_t nodes, int all, int first, int count, float* planes) {
  for (int64_t plane = 0; plane < 3; plane++) {
    const float* from = slices.data() + plane * nodes * kPlaneSlice;
    float* to = planes + (plane * all + first) * nodes;
    for (int c = 0; c < count; c++)
      for (int64_t i = 0; i < nodes; i++) to[c * nodes + i] = from[i * kPlaneSlice + c];
  }
}

}  // namespace

Hexplane::Hexplane(const std::vector<PlaneLevel>& levels, int channels)
    : levels_(levels), channels_(channels), space_(slices()), lines_(slices()) {
  parallel_for(slices(), [&](int64_t slice, int) {
    const PlanesTask task = slice_of({}, slice);
    const PlaneLevel& level = levels_[slice / per_level()];
    const int first = int(slice % per_level()) * kPlaneSlice;
    space_[slice] = packed(level.space, int64_t(level.nodes) * level.nodes, channels_, first, task.channels);
    lines_[slice] = packed(level.lines, level.nodes, channels_, first, task.channels);
  });
}

PlanesTask Hexplane::slice_of(const PlanesTask& whole, int64_t slice) const {
  PlanesTask task = whole;
  task.nodes = levels_[slice / per_level()].nodes;
  task.channels = std::min(kPlaneSlice, channels_ - int(slice % per_level()) * kPlaneSlice);
  task.space = space_[slice].data();
  task.lines = lines_[slice].data();
  task.row = int64_t(levels_.size()) * channels_;
  return task;
}

int64_t Hexplane::first_feature(int64_t slice) const {
  return slice / per_level() * channels_ + slice % per_level() * kPlaneSlice;
}

void Hexplane::forward(const PlanesTask& whole, int64_t n, float* features) const {
  const int64_t parts = (n + kPlanePoints - 1) / kPlanePoints;
  parallel_for(parts * slices(), [&](int64_t job, int) {
    PlanesTask task = slice_of(whole, job / parts);
    task.first = job % parts * kPlanePoints;
    task.last = std::min(n, task.first + kPlanePoints);
    task.features = features + first_feature(job / parts);
    kernels().planes(task);
  });
}

void Hexplane::backward(const PlanesTask& whole, int64_t n, const float* d_features,
                        const std::vector<PlaneLevelGradient>& gradients) const {
  parallel_for(slices(), [&](int64_t job, int) {
    const int64_t slice = slices() - 1 - job;  // the finest first: they take longest
    PlanesTask task = slice_of(whole, slice);
    Floats d_space(space_[slice].size(), 0.0f), d_lines(lines_[slice].size(), 0.0f);
    task.last = n;
    task.d_features = d_features + first_feature(slice);
    task.d_space = d_space.data();
    task.d_lines = d_lines.data();
    kernels().planes_backward(task);
    const PlaneLevelGradient& out = gradients[slice / per_level()];
    const int first = int(slice % per_level()) * kPlaneSlice;
    unpack(d_space, int64_t(task.nodes) * task.nodes, channels_, first, task.channels, out.space);
    unpack(d_lines, task.nodes, channels_, first, task.channels, out.lines);
  });
}

}  // namespace dd
