#include "network_run.h"

#include <algorithm>

#include "threads.h"

namespace dd {
namespace {

constexpr int64_t kMostChunks = 32;  // whose weight gradients are kept apart, then added in order

int64_t blocks_of(int64_t n) { return (n + kNetworkRows - 1) / kNetworkRows; }

int64_t packed_size(const NetworkShape& shape) {
  int64_t size = 0;
  for (int i = 0; i <= shape.depth; i++) size += network_layer(shape, i).weights();
  return size;
}

// Calls visit(dense, place in its weight or bias, whether bias, place when packed) for every number of the network.
template <class Visit>
void for_weights(const NetworkShape& shape, const std::vector<Dense>& layers, const Visit& visit) {
  int64_t begin = 0;
  int column = 0;
  for (size_t d = 0; d < layers.size(); d++) {
    const NetworkLayer layer = network_layer(shape, std::min(int(d), shape.depth));
    const int gap = padded(shape.encoded()) - shape.encoded();
    for (int o = 0; o < layers[d].outputs; o++) {
      for (int k = 0; k < layers[d].inputs; k++) {
        const int row = layer.stretches == 2 && k >= shape.encoded() ? k + gap : k;
        visit(d, int64_t(o) * layers[d].inputs + k, false, begin + int64_t(row) * layer.outputs + column + o);
      }
      visit(d, o, true, begin + int64_t(layer.inputs()) * layer.outputs + column + o);
    }
    if (int(d) < shape.depth)
      begin += layer.weights();
    else
      column += layers[d].outputs;
  }
}

std::vector<float> packed(const NetworkShape& shape, const std::vector<Dense>& layers) {
  std::vector<float> weights(packed_size(shape), 0.0f);
  for_weights(shape, layers, [&](size_t d, int64_t from, bool bias, int64_t to) {
    weights[to] = (bias ? layers[d].bias : layers[d].weight)[from];
  });
  return weights;
}

// The matrices that pass gradients on to the layer before, (outputs x width) each.
std::vector<float> transposed(const NetworkShape& shape, const std::vector<float>& weights) {
  const int width = padded(shape.width);
  std::vector<float> out;
  int64_t begin = network_layer(shape, 0).weights();
  for (int i = 1; i <= shape.depth; i++) {
    const NetworkLayer layer = network_layer(shape, i);
    const float* matrix = weights.data() + begin + int64_t(layer.inputs() - width) * layer.outputs;
    for (int o = 0; o < layer.outputs; o++)
      for (int k = 0; k < width; k++) out.push_back(matrix[int64_t(k) * layer.outputs + o]);
    begin += layer.weights();
  }
  return out;
}

}  // namespace

int64_t network_values(const NetworkShape& shape, int64_t n) { return blocks_of(n) * kNetworkRows * shape.row(); }

void network_forward(const NetworkShape& shape, const std::vector<Dense>& layers, NetworkTask whole, int64_t n,
                     float* values) {
  const std::vector<float> weights = packed(shape, layers);
  const int64_t block_size = int64_t(kNetworkRows) * shape.row();
  std::vector<float> work(thread_count() * (shape.scratch() + (values ? 0 : block_size)));
  whole.shape = shape;
  whole.weights = weights.data();
  parallel_for(blocks_of(n), [&](int64_t block, int worker) {
    NetworkTask task = whole;
    task.first = block * kNetworkRows;
    task.last = std::min(n, task.first + kNetworkRows);
    task.scratch = work.data() + worker * (work.size() / thread_count());
    task.values = values ? values + block * block_size : task.scratch + shape.scratch();
    kernels().network(task);
  });
}

void network_backward(const NetworkShape& shape, const std::vector<Dense>& layers, NetworkTask whole, int64_t n,
                      const float* values, const std::vector<DenseGradient>& gradients) {
  const std::vector<float> weights = packed(shape, layers), passing = transposed(shape, weights);
  const int64_t chunk_blocks = std::max<int64_t>(1, (blocks_of(n) + kMostChunks - 1) / kMostChunks);
  const int64_t chunks = (blocks_of(n) + chunk_blocks - 1) / chunk_blocks, size = int64_t(weights.size());
  std::vector<float> work(thread_count() * shape.scratch()), sums(std::max<int64_t>(chunks, 1) * size, 0.0f);
  whole.shape = shape;
  whole.weights = weights.data();
  whole.transposed = passing.data();
  parallel_for(chunks, [&](int64_t chunk, int worker) {
    NetworkTask task = whole;
    task.scratch = work.data() + worker * shape.scratch();
    task.d_weights = sums.data() + chunk * size;
    for (int64_t block = chunk * chunk_blocks; block < std::min(blocks_of(n), (chunk + 1) * chunk_blocks); block++) {
      task.first = block * kNetworkRows;
      task.last = std::min(n, task.first + kNetworkRows);
      task.values = const_cast<float*>(values) + task.first * shape.row();
      kernels().network_backward(task);
    }
  });
  constexpr int64_t kPart = 2048;
  parallel_for((size + kPart - 1) / kPart, [&](int64_t part, int) {
    for (int64_t chunk = 1; chunk < chunks; chunk++)
      for (int64_t i = part * kPart; i < std::min(size, (part + 1) * kPart); i++) sums[i] += sums[chunk * size + i];
  });
  for_weights(shape, layers, [&](size_t d, int64_t to, bool bias, int64_t from) {
    (bias ? gradients[d].bias : gradients[d].weight)[to] = sums[from];
  });
}

}  // namespace dd
