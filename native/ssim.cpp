// Structural similarity (Wang et al. 2004) of a band of rows: 11-tap Gaussian window, sigma 1.5, zero padding, as in 3DGS.
#include "kernel_list.h"
#include "lanes.h"

namespace dd::DD_ISA {
namespace {

constexpr int kTaps = 2 * kSsimRadius + 1;
constexpr float kC1 = 0.01f * 0.01f, kC2 = 0.03f * 0.03f;
// exp(-k^2 / (2 1.5^2)) for k = -5..5, divided by its sum.
constexpr float kWindow[kTaps] = {0.00102838008447911f, 0.00759875813523919f, 0.0360007721284308f, 0.109360689509700f,
                                  0.213005537711254f,   0.266011724861794f,   0.213005537711254f,  0.109360689509700f,
                                  0.0360007721284308f,  0.00759875813523919f, 0.00102838008447911f};

// Sum of eleven rows of lanes, weighted by the window.
template <class Row>
static inline V windowed(const Row& row) {
  V sum = kWindow[kSsimRadius] * row(kSsimRadius);
  for (int k = 0; k < kSsimRadius; k++) sum += kWindow[k] * (row(k) + row(kTaps - 1 - k));
  return sum;
}

// The first lanes of a row that may end within them.
static inline V load_part(const float* p, int count) {
  if (count >= kLanes) return load(p);
  V v = V{};
  for (int l = 0; l < count; l++) v[l] = p[l];
  return v;
}
static inline void store_part(float* p, V v, int count) {
  if (count >= kLanes) return store(p, v);
  for (int l = 0; l < count; l++) p[l] = v[l];
}

// Blurred rows of `kMaps` images around the current one: slot y mod 11, kMaps rows each.
template <int kMaps>
struct Ring {
  float *padded, *rows;
  int n, stride;  // floats of a row, and with padding
  Ring(const SsimTask& task)
      : padded(task.scratch), rows(task.scratch + kMaps * ssim_row(task.width)), n(3 * task.width),
        stride(ssim_row(task.width)) {
    __builtin_memset(padded, 0, sizeof(float) * kMaps * stride);
  }
  float* slot(int y) const { return rows + int64_t((y + kTaps) % kTaps) * kMaps * stride; }
  float* input(int map) { return padded + map * stride + 3 * kSsimRadius; }

  // Blurs the input rows along x; channels are interleaved, so a tap is a shift by three floats.
  void blur_input_into(int y) {
    for (int map = 0; map < kMaps; map++) {
      const float* from = padded + map * stride;
      float* to = slot(y) + map * stride;
      for (int i = 0; i < n; i += kLanes)
        store(to + i, windowed([&](int k) { return load(from + i + 3 * k); }));
    }
  }
  void clear(int y) { __builtin_memset(slot(y), 0, sizeof(float) * kMaps * stride); }
};

// The eleven rows around y: blurs along y.
template <int kMaps>
struct Column {
  const float* row[kTaps];
  int stride;
  Column(const Ring<kMaps>& ring, int y) : stride(ring.stride) {
    for (int k = 0; k < kTaps; k++) row[k] = ring.slot(y + k - kSsimRadius);
  }
  V at(int map, int i) const {
    return windowed([&](int k) { return load(row[k] + map * stride + i); });
  }
};

void fill_moments(const SsimTask& task, Ring<5>& ring, int y) {
  if (y < 0 || y >= task.height) return ring.clear(y);
  const int64_t start = int64_t(y) * ring.n;
  for (int i = 0; i < ring.n; i += kLanes) {
    const int count = ring.n - i;
    const V x = load_part(task.image + start + i, count), t = load_part(task.target + start + i, count);
    const V moments[5] = {x, t, x * x, t * t, x * t};
    for (int m = 0; m < 5; m++) store_part(ring.input(m) + i, moments[m], count);
  }
  ring.blur_input_into(y);
}

template <bool kGradient>
void similarity_row(const SsimTask& task, const Ring<5>& ring, int y) {
  const Column<5> column(ring, y);
  const int64_t start = int64_t(y) * ring.n;
  for (int i = 0; i < ring.n; i += kLanes) {
    const int count = ring.n - i;
    const V mean_x = column.at(0, i), mean_t = column.at(1, i);
    const V var_x = column.at(2, i) - mean_x * mean_x, var_t = column.at(3, i) - mean_t * mean_t;
    const V covariance = column.at(4, i) - mean_x * mean_t;
    const V a1 = 2.0f * mean_x * mean_t + kC1, a2 = 2.0f * covariance + kC2;
    const V inverse_b1 = 1.0f / (mean_x * mean_x + mean_t * mean_t + kC1);
    const V inverse_b2 = 1.0f / (var_x + var_t + kC2);
    const V s = a1 * a2 * inverse_b1 * inverse_b2;
    store_part(task.map + start + i, s, count);
    if (kGradient) {
      const V by_variance = -s * inverse_b2, by_covariance = 2.0f * a1 * inverse_b1 * inverse_b2;
      store_part(task.d_square + start + i, by_variance, count);
      store_part(task.d_product + start + i, by_covariance, count);
      const V by_mean = 2.0f * (mean_t * a2 * inverse_b2 - mean_x * s) * inverse_b1;
      store_part(task.d_mean + start + i, by_mean - 2.0f * mean_x * by_variance - mean_t * by_covariance, count);
    }
  }
}

void fill_gradients(const SsimTask& task, Ring<3>& ring, int y) {
  if (y < 0 || y >= task.height) return ring.clear(y);
  const int64_t start = int64_t(y) * ring.n;
  const float* maps[3] = {task.d_mean + start, task.d_square + start, task.d_product + start};
  for (int i = 0; i < ring.n; i += kLanes) {
    const int count = ring.n - i;
    const V upstream = load_part(task.d_map + start + i, count);
    for (int m = 0; m < 3; m++) store_part(ring.input(m) + i, upstream * load_part(maps[m] + i, count), count);
  }
  ring.blur_input_into(y);
}

void gradient_row(const SsimTask& task, const Ring<3>& ring, int y) {
  const Column<3> column(ring, y);
  const int64_t start = int64_t(y) * ring.n;
  for (int i = 0; i < ring.n; i += kLanes) {
    const int count = ring.n - i;
    const V x = load_part(task.image + start + i, count), t = load_part(task.target + start + i, count);
    store_part(task.d_image + start + i, column.at(0, i) + 2.0f * x * column.at(1, i) + t * column.at(2, i), count);
  }
}

}  // namespace

void ssim(const SsimTask& task) {
  Ring<5> ring(task);
  for (int y = task.first_row - kSsimRadius; y < task.last_row + kSsimRadius; y++) {
    fill_moments(task, ring, y);
    const int row = y - kSsimRadius;
    if (row >= task.first_row) task.d_mean ? similarity_row<true>(task, ring, row) : similarity_row<false>(task, ring, row);
  }
}

void ssim_backward(const SsimTask& task) {
  Ring<3> ring(task);
  for (int y = task.first_row - kSsimRadius; y < task.last_row + kSsimRadius; y++) {
    fill_gradients(task, ring, y);
    if (y - kSsimRadius >= task.first_row) gradient_row(task, ring, y - kSsimRadius);
  }
}

}  // namespace dd::DD_ISA
