// A network on a block of points: positional encoding, dense layers with ReLU, and their gradients.
#include "kernel_list.h"
#include "lanes.h"

namespace dd::DD_ISA {
namespace {

static_assert(kNetworkRows % kPad == 0 && kPad % kLanes == 0);

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

// The value, then sine and cosine of 2^0, 2^1, ... times it; then the time's code; then zeros up to the padding. What is
// given is taken as it is.
void encode(const NetworkTask& task, const Octaves& octaves, int64_t point, float* row) {
  if (const int given = task.shape.given) {
    __builtin_memcpy(row, task.given + given * point, sizeof(float) * given);
    __builtin_memset(row + given, 0, sizeof(float) * (padded(given) - given));
    return;
  }
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

// A tile of a product, whose sums stay in registers; its sides divide kPad.
template <int kTileRows, int kTileVectors>
struct Tile {
  static constexpr int rows = kTileRows, vectors = kTileVectors;
  V sum[rows][vectors];

  void add_product(Left a, Right b, int steps) {
    for (int k = 0; k < steps; k++) {
      V columns[vectors];
      for (int c = 0; c < vectors; c++) columns[c] = load(b.at + k * b.step + c * kLanes);
      for (int r = 0; r < rows; r++) {
        const V x = broadcast(a.at[r * a.row + k * a.step]);
        for (int c = 0; c < vectors; c++) sum[r][c] += x * columns[c];
      }
    }
  }
  // Calls visit(row, column, sum) for its parts.
  template <class Visit>
  void each(const Visit& visit) {
    for (int r = 0; r < rows; r++)
      for (int c = 0; c < vectors; c++) visit(r, c * kLanes, sum[r][c]);
  }
};

// Calls run(row, column, tile) for all tiles. AVX-512 has registers for four rows of four vectors, AVX2 for four of three.
constexpr int kWidest = DD_LANES == 16 ? 4 : 3;
template <class Run>
static inline void for_tiles(int rows, int columns, const Run& run) {
  const auto strip = [&](int column, auto tile) {
    for (int row = 0; row < rows; row += decltype(tile)::rows) run(row, column, tile);
    return column + decltype(tile)::vectors * kLanes;
  };
  int column = 0;
  while (column + kWidest * kLanes <= columns) column = strip(column, Tile<4, kWidest>());
  while (column + 2 * kLanes <= columns) column = strip(column, Tile<4, 2>());
  while (column < columns) column = strip(column, Tile<8, 1>());
}

// What a block of points is worked on in.
struct Block {
  const NetworkTask& task;
  const NetworkShape& shape;
  int rows;                                     // points and padding
  int64_t row_size;
  float* values;                                // rows of values
  explicit Block(const NetworkTask& t)
      : task(t), shape(t.shape), rows(padded(t.count)), row_size(t.shape.row()), values(t.scratch) {}
  float* work(int which) const { return values + kNetworkRows * (row_size + which * shape.most()); }
};

// The layer's outputs for all rows of the block, to + row * step; hidden ones through ReLU.
template <bool kHidden>
void apply(const Block& block, const NetworkLayer& layer, const float* weights, float* to, int64_t step) {
  const float* bias = weights + layer.weights() - layer.outputs;
  for_tiles(block.rows, layer.outputs, [&](int row, int column, auto tile) {
    tile.each([&](int, int c, V& sum) { sum = load(bias + column + c); });
    const float* matrix = weights + column;
    for (int s = 0; s < layer.stretches; s++) {
      const NetworkLayer::Stretch from = layer.stretch[s];
      tile.add_product({block.values + row * block.row_size + from.at, block.row_size, 1}, {matrix, layer.outputs},
                       from.inputs);
      matrix += from.inputs * layer.outputs;
    }
    tile.each([&](int r, int c, V& sum) {
      store(to + (row + r) * step + column + c, kHidden ? vmax(V{}, sum) : sum);
    });
  });
}

// The rows of values; returns the weights of the heads.
const float* fill(const Block& block) {
  const NetworkShape& shape = block.shape;
  const Octaves octaves(shape.position_octaves);
  for (int r = 0; r < block.rows; r++) {
    float* row = block.values + r * block.row_size;
    if (r < block.task.count)
      encode(block.task, octaves, block.task.points[r], row);
    else
      __builtin_memset(row, 0, sizeof(float) * padded(shape.encoded()));
  }
  const float* weights = block.task.weights;
  for (int i = 0; i < shape.depth; i++) {
    const NetworkLayer layer = network_layer(shape, i);
    apply<true>(block, layer, weights, block.values + network_layer(shape, i + 1).near().at, block.row_size);
    weights += layer.weights();
  }
  return weights;
}

// Adds to d_weights, laid out as the weights, what the gradient of the layer's outputs (rows x outputs) makes of them.
void add_weight_gradients(const Block& block, const NetworkLayer& layer, const float* d_outputs, float* d_weights) {
  float* matrix = d_weights;
  for (int s = 0; s < layer.stretches; s++) {
    const NetworkLayer::Stretch from = layer.stretch[s];
    for_tiles(from.inputs, layer.outputs, [&](int input, int column, auto tile) {
      float* to = matrix + input * layer.outputs + column;
      tile.each([&](int r, int c, V& sum) { sum = load(to + r * layer.outputs + c); });
      tile.add_product({block.values + from.at + input, 1, block.row_size}, {d_outputs + column, layer.outputs}, block.rows);
      tile.each([&](int r, int c, V& sum) { store(to + r * layer.outputs + c, sum); });
    });
    matrix += from.inputs * layer.outputs;
  }
  for (int column = 0; column < layer.outputs; column += kLanes) {
    V sum = load(matrix + column);
    for (int row = 0; row < block.rows; row++) sum += load(d_outputs + row * layer.outputs + column);
    store(matrix + column, sum);
  }
}

// Gradient (rows x inputs) of the last stretch that a layer reads; of hidden values before their ReLU.
void pass_back(const Block& block, const NetworkLayer& layer, bool hidden, const float* transposed,
               const float* d_outputs, float* d_inputs) {
  const NetworkLayer::Stretch from = layer.near();
  for_tiles(block.rows, from.inputs, [&](int row, int column, auto tile) {
    tile.each([](int, int, V& sum) { sum = V{}; });
    tile.add_product({d_outputs + row * layer.outputs, layer.outputs, 1}, {transposed + column, from.inputs}, layer.outputs);
    tile.each([&](int r, int c, V& sum) {
      const V value = load(block.values + (row + r) * block.row_size + from.at + column + c);
      store(d_inputs + (row + r) * from.inputs + column + c, hidden ? masked(value > V{}, sum) : sum);
    });
  });
}

}  // namespace

void network(const NetworkTask& task) {
  const Block block(task);
  const NetworkShape& shape = task.shape;
  const NetworkLayer heads = network_layer(shape, shape.depth);
  float* out = block.work(0);
  apply<false>(block, heads, fill(block), out, heads.outputs);
  for (int r = 0; r < task.count; r++)
    __builtin_memcpy(task.out + task.points[r] * shape.outputs, out + r * heads.outputs, sizeof(float) * shape.outputs);
}

// The values are computed anew: kept from the forward pass they would not fit in the cache, and took longer to fetch.
void network_backward(const NetworkTask& task) {
  const Block block(task);
  const NetworkShape& shape = task.shape;
  fill(block);
  float *d_outputs = block.work(0), *d_inputs = block.work(1);
  const int outputs = padded(shape.outputs);
  __builtin_memset(d_outputs, 0, sizeof(float) * block.rows * outputs);
  for (int r = 0; r < task.count; r++)
    __builtin_memcpy(d_outputs + r * outputs, task.d_out + task.points[r] * shape.outputs, sizeof(float) * shape.outputs);
  const float* transposed = task.transposed;
  float* d_weights = task.d_weights;
  for (int i = 0; i <= shape.depth; i++) d_weights += network_layer(shape, i).weights();
  for (int i = shape.depth; i >= 0; i--) {
    const NetworkLayer layer = network_layer(shape, i);
    d_weights -= layer.weights();
    add_weight_gradients(block, layer, d_outputs, d_weights);
    if (!passes_on(shape, i)) return;
    pass_back(block, layer, i > 0, transposed, d_outputs, d_inputs);
    transposed += layer.outputs * layer.near().inputs;
    float* swapped = d_outputs;
    d_outputs = d_inputs;
    d_inputs = swapped;
  }
  if (!task.d_given) return;
  for (int r = 0; r < task.count; r++)
    __builtin_memcpy(task.d_given + task.points[r] * shape.given, d_outputs + r * padded(shape.given),
                     sizeof(float) * shape.given);
}

}  // namespace dd::DD_ISA
