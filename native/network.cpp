// The deformation network on a block of points: positional encoding, dense layers with ReLU, and their gradients.
#include "kernel_list.h"
#include "lanes.h"

namespace dd::DD_ISA {
namespace {

constexpr int kRows = 4;  // of a tile of a product, whose sums stay in registers
static_assert(kNetworkRows % kRows == 0 && kPad % kRows == 0 && kPad % kLanes == 0);

// Sine and cosine of angles up to 10^4: what is left after subtracting quarter turns (pi / 2 in three parts), then the
// polynomials of Cephes' sinf and cosf. Further out the angle itself is known no better than to a thousandth.
static inline void sine_cosine(V angle, V* sine, V* cosine) {
  const V shifter = broadcast(12582912.0f);  // 1.5 * 2^23: adding it leaves the rounded integer in the low bits
  const V shifted = angle * 0.636619772367581f + shifter, turns = shifted - shifter;
  V x = ((angle - turns * 1.5703125f) - turns * 4.837512969970703e-4f) - turns * 7.549789948768648e-8f;
  x = vmin(vmax(x, broadcast(-0.8f)), broadcast(0.8f));
  const V z = x * x;
  const V s = x + x * z * ((-1.9515295891e-4f * z + 8.3321608736e-3f) * z - 1.6666654611e-1f);
  const V c = 1.0f - 0.5f * z + z * z * ((2.443315711809948e-5f * z - 1.388731625493765e-3f) * z + 4.166664568298827e-2f);
  const U quarter = (U)shifted;
  const I swapped = (I)(quarter & 1) != 0;
  *sine = (V)((U)(swapped ? c : s) ^ ((quarter & 2) << 30));
  *cosine = (V)((U)(swapped ? s : c) ^ (((quarter + 1) & 2) << 30));
}

constexpr int kMostAngles = 3 * kMostOctaves + kPad;

// The factors 2^0, 2^0, 2^0, 2^1, ... of an encoding.
struct Octaves {
  float factor[kMostAngles];
  explicit Octaves(int octaves) {
    for (int k = 0; k < kMostAngles; k++) factor[k] = k < 3 * octaves ? float(int64_t(1) << k / 3) : 0.0f;
  }
};

// The value, then sine and cosine of 2^0, 2^1, ... times it; then the time's code; then zeros up to the padding.
void encode(const NetworkTask& task, const Octaves& octaves, int64_t point, float* row) {
  const int angles = 3 * task.shape.position_octaves;
  float again[3 + kPad];  // x, y, z, x, y, z, ...
  for (int k = 0; k < 3 + kPad; k++)
    again[k] = k < 3 ? (task.means[3 * point + k] - task.centre[k]) / task.radius : again[k - 3];
  for (int k = 0; k < 3; k++) row[k] = again[k];
  float *sines = row + 3, *cosines = sines + angles, *code = cosines + angles;
  for (int first = 0; first < angles; first += kLanes) {
    V sine, cosine;
    sine_cosine(load(again + first % 3) * load(octaves.factor + first), &sine, &cosine);
    store_part(sines + first, sine, angles - first);
    store_part(cosines + first, cosine, angles - first);
  }
  for (int k = 0; k < task.shape.time_code; k++) code[k] = task.time_code[k];
  for (float* pad = code + task.shape.time_code; pad < row + padded(task.shape.encoded()); pad++) *pad = 0;
}

// One side of a matrix product: element (i, k) is at at + i row + k step.
struct Left {
  const float* at;
  int64_t row, step;
};
struct Right {
  const float* at;
  int64_t step;  // columns lie side by side
};

template <int kColumns>
static inline void add_product(V (&sum)[kRows][kColumns], Left a, Right b, int steps) {
  for (int k = 0; k < steps; k++) {
    V columns[kColumns];
    for (int c = 0; c < kColumns; c++) columns[c] = load(b.at + k * b.step + c * kLanes);
    for (int r = 0; r < kRows; r++) {
      const V x = broadcast(a.at[r * a.row + k * a.step]);
      for (int c = 0; c < kColumns; c++) sum[r][c] += x * columns[c];
    }
  }
}

// Calls tile(row, column, Width<k>) for all tiles of kRows rows and k vectors.
template <int kVectors>
struct Width {
  static constexpr int vectors = kVectors;
};
template <class Tile>
static inline void for_tiles(int rows, int columns, const Tile& tile) {
  int column = 0;
  for (; column + 3 * kLanes <= columns; column += 3 * kLanes)
    for (int row = 0; row < rows; row += kRows) tile(row, column, Width<3>());
  for (; column + 2 * kLanes <= columns; column += 2 * kLanes)
    for (int row = 0; row < rows; row += kRows) tile(row, column, Width<2>());
  for (; column < columns; column += kLanes)
    for (int row = 0; row < rows; row += kRows) tile(row, column, Width<1>());
}

// The layer's outputs for all rows of the block, to + row * step; hidden ones through ReLU.
template <bool kHidden>
void apply(const NetworkTask& task, const NetworkLayer& layer, const float* weights, float* to, int64_t step) {
  const int64_t row_size = task.shape.row();
  const float* bias = weights + layer.weights() - layer.outputs;
  for_tiles(kNetworkRows, layer.outputs, [&](int row, int column, auto width) {
    constexpr int kVectors = decltype(width)::vectors;
    V sum[kRows][kVectors];
    for (int r = 0; r < kRows; r++)
      for (int c = 0; c < kVectors; c++) sum[r][c] = load(bias + column + c * kLanes);
    const float* matrix = weights + column;
    for (int s = 0; s < layer.stretches; s++) {
      const NetworkLayer::Stretch from = layer.stretch[s];
      add_product<kVectors>(sum, {task.values + row * row_size + from.at, row_size, 1}, {matrix, layer.outputs},
                            from.inputs);
      matrix += from.inputs * layer.outputs;
    }
    for (int r = 0; r < kRows; r++)
      for (int c = 0; c < kVectors; c++)
        store(to + (row + r) * step + column + c * kLanes, kHidden ? vmax(V{}, sum[r][c]) : sum[r][c]);
  });
}

// Adds to d_weights, laid out as the weights, what the gradient of the layer's outputs (rows x outputs) makes of them.
void add_weight_gradients(const NetworkTask& task, const NetworkLayer& layer, const float* d_outputs, float* d_weights) {
  const int64_t row_size = task.shape.row();
  float* matrix = d_weights;
  for (int s = 0; s < layer.stretches; s++) {
    const NetworkLayer::Stretch from = layer.stretch[s];
    for_tiles(from.inputs, layer.outputs, [&](int input, int column, auto width) {
      constexpr int kVectors = decltype(width)::vectors;
      V sum[kRows][kVectors];
      float* to = matrix + input * layer.outputs + column;
      for (int r = 0; r < kRows; r++)
        for (int c = 0; c < kVectors; c++) sum[r][c] = load(to + r * layer.outputs + c * kLanes);
      add_product<kVectors>(sum, {task.values + from.at + input, 1, row_size}, {d_outputs + column, layer.outputs},
                            kNetworkRows);
      for (int r = 0; r < kRows; r++)
        for (int c = 0; c < kVectors; c++) store(to + r * layer.outputs + c * kLanes, sum[r][c]);
    });
    matrix += from.inputs * layer.outputs;
  }
  for (int column = 0; column < layer.outputs; column += kLanes) {
    V sum = load(matrix + column);
    for (int row = 0; row < kNetworkRows; row++) sum += load(d_outputs + row * layer.outputs + column);
    store(matrix + column, sum);
  }
}

// Gradient of the hidden values that a layer reads, before their ReLU.
void pass_back(const NetworkTask& task, const NetworkLayer& layer, const float* transposed, const float* d_outputs,
               float* d_inputs) {
  const int64_t row_size = task.shape.row();
  const NetworkLayer::Stretch from = layer.stretch[layer.stretches - 1];
  for_tiles(kNetworkRows, from.inputs, [&](int row, int column, auto width) {
    constexpr int kVectors = decltype(width)::vectors;
    V sum[kRows][kVectors] = {};
    add_product<kVectors>(sum, {d_outputs + row * layer.outputs, layer.outputs, 1}, {transposed + column, from.inputs},
                          layer.outputs);
    for (int r = 0; r < kRows; r++)
      for (int c = 0; c < kVectors; c++) {
        const V value = load(task.values + (row + r) * row_size + from.at + column + c * kLanes);
        store(d_inputs + (row + r) * from.inputs + column + c * kLanes, masked(value > V{}, sum[r][c]));
      }
  });
}

}  // namespace

void network(const NetworkTask& task) {
  const NetworkShape& shape = task.shape;
  const int64_t row_size = shape.row();
  const int points = int(task.last - task.first);
  const Octaves octaves(shape.position_octaves);
  for (int r = 0; r < points; r++) encode(task, octaves, task.first + r, task.values + r * row_size);
  for (int r = points; r < kNetworkRows; r++) __builtin_memset(task.values + r * row_size, 0, sizeof(float) * row_size);
  const float* weights = task.weights;
  for (int i = 0; i < shape.depth; i++) {
    const NetworkLayer layer = network_layer(shape, i);
    apply<true>(task, layer, weights, task.values + padded(shape.encoded()) + i * layer.outputs, row_size);
    weights += layer.weights();
  }
  const NetworkLayer heads = network_layer(shape, shape.depth);
  apply<false>(task, heads, weights, task.scratch, heads.outputs);
  for (int r = 0; r < points; r++)
    __builtin_memcpy(task.out + (task.first + r) * shape.outputs, task.scratch + r * heads.outputs,
                     sizeof(float) * shape.outputs);
}

void network_backward(const NetworkTask& task) {
  const NetworkShape& shape = task.shape;
  const int points = int(task.last - task.first), most = kNetworkRows * (padded(shape.width) + padded(shape.outputs));
  float *d_outputs = task.scratch, *d_inputs = task.scratch + most;
  const int outputs = padded(shape.outputs);
  __builtin_memset(d_outputs, 0, sizeof(float) * kNetworkRows * outputs);
  for (int r = 0; r < points; r++)
    __builtin_memcpy(d_outputs + r * outputs, task.d_out + (task.first + r) * shape.outputs,
                     sizeof(float) * shape.outputs);
  const int width = padded(shape.width);
  float* d_weights = task.d_weights;
  for (int i = 0; i <= shape.depth; i++) d_weights += network_layer(shape, i).weights();
  for (int i = shape.depth; i >= 0; i--) {
    const NetworkLayer layer = network_layer(shape, i);
    d_weights -= layer.weights();
    add_weight_gradients(task, layer, d_outputs, d_weights);
    if (i == 0) break;
    pass_back(task, layer, task.transposed + (i - 1) * width * width, d_outputs, d_inputs);
    float* swapped = d_outputs;
    d_outputs = d_inputs;
    d_inputs = swapped;
  }
}

}  // namespace dd::DD_ISA
