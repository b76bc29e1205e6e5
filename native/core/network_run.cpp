#include "network_run.h"

#include <algorithm>
#include <numeric>

#include "buffer.h"
#include "threads.h"

namespace dd {
namespace {

constexpr int64_t kMostChunks = 32;  // whose weight gradients are kept apart, then added in order

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

Floats packed(const NetworkShape& shape, const std::vector<Dense>& layers) {
  Floats weights(packed_size(shape), 0.0f);
  for_weights(shape, layers, [&](size_t d, int64_t from, bool bias, int64_t to) {
    weights[to] = (bias ? layers[d].bias : layers[d].weight)[from];
  });
  return weights;
}

// The matrices that pass gradients on, (outputs x inputs) each, from the last layer.
Floats transposed(const NetworkShape& shape, const Floats& weights) {
  Floats out;
  const float* end = weights.data() + weights.size();
  for (int i = shape.depth; i >= 0 && passes_on(shape, i); i--) {
    const NetworkLayer layer = network_layer(shape, i);
    const int inputs = layer.near().inputs;
    const float* matrix = end - int64_t(inputs + 1) * layer.outputs;
    for (int o = 0; o < layer.outputs; o++)
      for (int k = 0; k < inputs; k++) out.push_back(matrix[int64_t(k) * layer.outputs + o]);
    end -= layer.weights();
  }
  return out;
}

// Points [first, last) that some gradient arrives at: the others change no weight.
std::vector<int64_t> reached(const NetworkTask& task, int64_t first, int64_t last) {
  std::vector<int64_t> points;
  const int outputs = task.shape.outputs;
  for (int64_t i = first; i < last; i++) {
    const float* row = task.d_out + i * outputs;
    if (std::any_of(row, row + outputs, [](float x) { return x != 0.0f; })) points.push_back(i);
  }
  return points;
}

}  // namespace

void network_forward(const NetworkShape& shape, const std::vector<Dense>& layers, NetworkTask whole, int64_t n) {
  const Floats weights = packed(shape, layers);
  const int workers = thread_count();
  Floats work(workers * shape.scratch());
  whole.shape = shape;
  whole.weights = weights.data();
  const auto run = [&](int64_t block, int worker) {
    const int64_t first = block * kNetworkRows;
    int64_t points[kNetworkRows];
    std::iota(points, points + kNetworkRows, first);
    NetworkTask task = whole;
    task.points = points;
    task.count = int(std::min<int64_t>(n - first, kNetworkRows));
    task.scratch = work.data() + worker * shape.scratch();
    kernels().network(task);
  };
  parallel_for((n + kNetworkRows - 1) / kNetworkRows, run, workers);
}

void network_backward(const NetworkShape& shape, const std::vector<Dense>& layers, NetworkTask whole, int64_t n,
                      const std::vector<DenseGradient>& gradients) {
  const Floats weights = packed(shape, layers), passing = transposed(shape, weights);
  const int64_t chunk_points = std::max<int64_t>(kNetworkRows, (n + kMostChunks - 1) / kMostChunks);
  const int64_t chunks = (n + chunk_points - 1) / chunk_points, size = int64_t(weights.size());
  const int workers = thread_count();
  Floats work(workers * shape.scratch()), sums(std::max<int64_t>(chunks, 1) * size, 0.0f);
  whole.shape = shape;
  whole.weights = weights.data();
  whole.transposed = passing.data();
  const auto run = [&](int64_t chunk, int worker) {
    const int64_t first = chunk * chunk_points, last = std::min(n, first + chunk_points);
    NetworkTask task = whole;
    task.scratch = work.data() + worker * shape.scratch();
    task.d_weights = sums.data() + chunk * size;
    if (task.d_given) std::fill(task.d_given + first * shape.given, task.d_given + last * shape.given, 0.0f);
    const std::vector<int64_t> points = reached(task, first, last);
    for (size_t at = 0; at < points.size(); at += kNetworkRows) {
      task.points = points.data() + at;
      task.count = int(std::min<size_t>(points.size() - at, kNetworkRows));
      kernels().network_backward(task);
    }
  };
  parallel_for(chunks, run, workers);
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
