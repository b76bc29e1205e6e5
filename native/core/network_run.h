// A network on many points: weights laid out for the kernels, blocks of points shared among the threads.
#pragma once
#include <cstdint>
#include <vector>

#include "kernels/types.h"

namespace dd {

// A dense layer as torch keeps it, or one of the heads: weights (outputs, inputs) and bias (outputs).
struct Dense {
  const float *weight, *bias;
  int outputs, inputs;
};
struct DenseGradient {
  float *weight, *bias;
};

// Writes out (n, outputs). The layers are the hidden ones, then the heads, whose outputs are put side by side.
void network_forward(const NetworkShape& shape, const std::vector<Dense>& layers, NetworkTask task, int64_t n);
// Of the same task with d_out, and d_given if that gradient is wanted.
void network_backward(const NetworkShape& shape, const std::vector<Dense>& layers, NetworkTask task, int64_t n,
                      const std::vector<DenseGradient>& gradients);

}  // namespace dd
