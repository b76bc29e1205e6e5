// The deformation network on many points: weights laid out for the kernels, blocks of points shared among the threads.
#pragma once
#include <cstdint>
#include <vector>

#include "types.h"

namespace dd {

// A dense layer as torch keeps it, or one of the heads: weights (outputs, inputs) and bias (outputs).
struct Dense {
  const float *weight, *bias;
  int outputs, inputs;
};
struct DenseGradient {
  float *weight, *bias;
};

// Floats of the values that the backward pass needs of n points.
int64_t network_values(const NetworkShape& shape, int64_t n);

// Writes out (n, outputs); values, of network_values floats, only if not null. The layers are the hidden ones, then the
// heads, whose outputs are put side by side.
void network_forward(const NetworkShape& shape, const std::vector<Dense>& layers, NetworkTask task, int64_t n, float* values);
void network_backward(const NetworkShape& shape, const std::vector<Dense>& layers, NetworkTask task, int64_t n,
                      const float* values, const std::vector<DenseGradient>& gradients);

}  // namespace dd
