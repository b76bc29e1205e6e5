// Structural similarity (Wang et al. 2004) of a band of rows: 11-tap Gaussian window, sigma 1.5, zero padding, as in 3DGS.
#include "kernel_list.h"

namespace dd::DD_ISA {
namespace {

constexpr int kTaps = 2 * kSsimRadius + 1;
constexpr float kC1 = 0.01f * 0.01f, kC2 = 0.03f * 0.03f;
// exp(-k^2 / (2 1.5^2)) for k = -5..5, divided by its sum.
constexpr float kWindow[kTaps] = {0.00102838008447911f, 0.00759875813523919f, 0.0360007721284308f, 0.109360689509700f,
                                  0.213005537711254f,   0.266011724861794f,   0.213005537711254f,  0.109360689509700f,
                                  0.0360007721284308f,  0.00759875813523919f, 0.00102838008447911f};

// Blurred rows of `kMaps` images around the current one: slot y mod 11, kMaps rows of 3 w floats each.
template <int kMaps>
struct Ring {
  float *padded, *rows;
  int row_floats, padded_floats;
  Ring(const SsimTask& task)
      : padded(task.scratch), rows(task.scratch + kMaps * ssim_row(task.width)), row_floats(3 * task.width),
        padded_floats(ssim_row(task.width)) {
    __builtin_memset(padded, 0, sizeof(float) * kMaps * padded_floats);
  }
  float* slot(int y) { return rows + int64_t((y + kTaps) % kTaps) * kMaps * row_floats; }
  float* input(int map) { return padded + map * padded_floats + 3 * kSsimRadius; }

  // Blurs the input rows along x; channels are interleaved, so a tap is a shift by three floats.
  void blur_input_into(int y) {
    for (int map = 0; map < kMaps; map++) {
      const float* __restrict from = padded + map * padded_floats;
      float* __restrict to = slot(y) + map * row_floats;
      for (int i = 0; i < row_floats; i++) {
        float sum = 0;
        for (int k = 0; k < kTaps; k++) sum += kWindow[k] * from[i + 3 * k];
        to[i] = sum;
      }
    }
  }
  void clear(int y) { __builtin_memset(slot(y), 0, sizeof(float) * kMaps * row_floats); }

  struct Column {
    const float* row[kTaps];
    float at(int offset) const {
      float sum = 0;
      for (int k = 0; k < kTaps; k++) sum += kWindow[k] * row[k][offset];
      return sum;
    }
  };
  Column column(int y) {
    Column c;
    for (int k = 0; k < kTaps; k++) c.row[k] = slot(y + k - kSsimRadius);
    return c;
  }
};

void fill_moments(const SsimTask& task, Ring<5>& ring, int y) {
  if (y < 0 || y >= task.height) return ring.clear(y);
  const float* __restrict x = task.image + int64_t(y) * ring.row_floats;
  const float* __restrict t = task.target + int64_t(y) * ring.row_floats;
  float *a = ring.input(0), *b = ring.input(1), *aa = ring.input(2), *bb = ring.input(3), *ab = ring.input(4);
  for (int i = 0; i < ring.row_floats; i++) {
    a[i] = x[i];
    b[i] = t[i];
    aa[i] = x[i] * x[i];
    bb[i] = t[i] * t[i];
    ab[i] = x[i] * t[i];
  }
  ring.blur_input_into(y);
}

template <bool kGradient>
void similarity_row(const SsimTask& task, Ring<5>& ring, int y) {
  const auto column = ring.column(y);
  const int n = ring.row_floats;
  const int64_t start = int64_t(y) * n;
  float* __restrict map = task.map + start;
  float* __restrict d_mean = kGradient ? task.d_mean + start : nullptr;
  float* __restrict d_square = kGradient ? task.d_square + start : nullptr;
  float* __restrict d_product = kGradient ? task.d_product + start : nullptr;
  for (int i = 0; i < n; i++) {
    const float mean_x = column.at(i), mean_t = column.at(i + n);
    const float var_x = column.at(i + 2 * n) - mean_x * mean_x, var_t = column.at(i + 3 * n) - mean_t * mean_t;
    const float covariance = column.at(i + 4 * n) - mean_x * mean_t;
    const float a1 = 2.0f * mean_x * mean_t + kC1, a2 = 2.0f * covariance + kC2;
    const float inverse_b1 = 1.0f / (mean_x * mean_x + mean_t * mean_t + kC1);
    const float inverse_b2 = 1.0f / (var_x + var_t + kC2);
    const float s = a1 * a2 * inverse_b1 * inverse_b2;
    map[i] = s;
    if (kGradient) {
      const float by_variance = -s * inverse_b2, by_covariance = 2.0f * a1 * inverse_b1 * inverse_b2;
      d_square[i] = by_variance;
      d_product[i] = by_covariance;
      d_mean[i] = 2.0f * (mean_t * a2 * inverse_b2 - mean_x * s) * inverse_b1 - 2.0f * mean_x * by_variance -
                  mean_t * by_covariance;
    }
  }
}

void fill_gradients(const SsimTask& task, Ring<3>& ring, int y) {
  if (y < 0 || y >= task.height) return ring.clear(y);
  const int64_t start = int64_t(y) * ring.row_floats;
  const float* maps[3] = {task.d_mean + start, task.d_square + start, task.d_product + start};
  const float* __restrict upstream = task.d_map + start;
  for (int m = 0; m < 3; m++) {
    float* __restrict to = ring.input(m);
    for (int i = 0; i < ring.row_floats; i++) to[i] = upstream[i] * maps[m][i];
  }
  ring.blur_input_into(y);
}

void gradient_row(const SsimTask& task, Ring<3>& ring, int y) {
  const auto column = ring.column(y);
  const int n = ring.row_floats;
  const int64_t start = int64_t(y) * n;
  const float* __restrict x = task.image + start;
  const float* __restrict t = task.target + start;
  float* __restrict out = task.d_image + start;
  for (int i = 0; i < n; i++)
    out[i] = column.at(i) + 2.0f * x[i] * column.at(i + n) + t[i] * column.at(i + 2 * n);
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
