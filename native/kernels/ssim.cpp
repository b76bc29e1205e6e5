// Structural similarity (Wang et al. 2004) of a band of rows: 11-tap Gaussian window, sigma 1.5, zero padding, as in 3DGS;
// and the loss L1 + SSIM, which sums over the band instead of writing the map.
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

// `kMaps` images around the current row: eleven rows of each as they are, and the current one blurred along y between
// margins of zeros, from which it is blurred along x.
template <int kMaps>
struct Ring {
  float *current, *rows;
  int n, stride;  // floats of a row, and with margins
  Ring(const SsimTask& task)
      : current(task.scratch), rows(task.scratch + kMaps * ssim_row(task.width)), n(3 * task.width),
        stride(ssim_row(task.width)) {
    __builtin_memset(task.scratch, 0, sizeof(float) * kMaps * stride * (1 + kTaps));
  }
  float* slot(int map, int y) { return rows + ((y + kTaps) % kTaps * kMaps + map) * int64_t(stride); }
  void clear(int y) { __builtin_memset(slot(0, y), 0, sizeof(float) * kMaps * stride); }

  void blur_along_y(int y) {
    for (int map = 0; map < kMaps; map++) {
      const float* row[kTaps];
      for (int k = 0; k < kTaps; k++) row[k] = slot(map, y + k - kSsimRadius);
      float* to = current + map * stride + 3 * kSsimRadius;
      for (int i = 0; i < n; i += kLanes) store(to + i, windowed([&](int k) { return load(row[k] + i); }));
    }
  }
  // Channels are interleaved: a tap is a shift by three floats.
  V blurred(int map, int i) const {
    const float* from = current + map * stride + i;
    return windowed([&](int k) { return load(from + 3 * k); });
  }
};

// What a row of the loss needs besides the blurred moments.
struct LossRow {
  int32_t* counts;    // all bits of the values of pixels that count, none elsewhere
  V difference = V{}, similarity = V{};

  void load_mask(const SsimTask& task, int y) {
    const uint8_t* mask = task.mask + int64_t(y) * task.width;
    for (int x = 0; x < task.width; x++)
      for (int c = 0; c < 3; c++) counts[3 * x + c] = -int32_t(mask[x] != 0);
  }
};

// Where the mask is off, the image is taken to equal the target.
template <bool kLoss>
void fill_moments(const SsimTask& task, Ring<4>& ring, LossRow& loss, int y) {
  if (y < 0 || y >= task.height) return ring.clear(y);
  if (kLoss) loss.load_mask(task, y);
  const int64_t start = int64_t(y) * ring.n;
  float* const to[4] = {ring.slot(0, y), ring.slot(1, y), ring.slot(2, y), ring.slot(3, y)};
  V difference = V{};
  for (int i = 0; i < ring.n; i += kLanes) {
    const int count = ring.n - i;
    const V t = load_part(task.target + start + i, count);
    V x = load_part(task.image + start + i, count);
    if (kLoss) {
      x = load(loss.counts + i) ? x : t;
      difference += vabs(x - t);
    }
    store_part(to[0] + i, x, count);
    store_part(to[1] + i, t, count);
    store_part(to[2] + i, x * x + t * t, count);  // the two variances are only ever added
    store_part(to[3] + i, x * t, count);
  }
  if (kLoss && y >= task.first_row && y < task.last_row) loss.difference += difference;
}

template <bool kGradient, bool kLoss>
void similarity_row(const SsimTask& task, Ring<4>& ring, LossRow& loss, int y) {
  ring.blur_along_y(y);
  const int64_t start = int64_t(y) * ring.n;
  for (int i = 0; i < ring.n; i += kLanes) {
    const int count = ring.n - i;
    const V mean_x = ring.blurred(0, i), mean_t = ring.blurred(1, i);
    const V squares = mean_x * mean_x + mean_t * mean_t;
    const V variances = ring.blurred(2, i) - squares, covariance = ring.blurred(3, i) - mean_x * mean_t;
    const V a1 = 2.0f * mean_x * mean_t + kC1, a2 = 2.0f * covariance + kC2;
    const V b1 = squares + kC1, b2 = variances + kC2, inverse = 1.0f / (b1 * b2);
    const V inverse_b1 = b2 * inverse, inverse_b2 = b1 * inverse, s = a1 * a2 * inverse;
    if (kLoss)
      loss.similarity += masked(iota() < float(count), s);
    else
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

template <bool kGradient, bool kLoss>
void similarity_band(const SsimTask& task) {
  Ring<4> ring(task);
  LossRow loss = {reinterpret_cast<int32_t*>(task.scratch + (kSsimScratchRows - 1) * ssim_row(task.width))};
  double difference = 0, similarity = 0;
  for (int y = task.first_row - kSsimRadius; y < task.last_row + kSsimRadius; y++) {
    fill_moments<kLoss>(task, ring, loss, y);
    const int row = y - kSsimRadius;
    if (row >= task.first_row) similarity_row<kGradient, kLoss>(task, ring, loss, row);
    difference += sum_lanes(loss.difference);
    similarity += sum_lanes(loss.similarity);
    loss.difference = loss.similarity = V{};
  }
  if (kLoss) {
    task.sums[0] = difference;
    task.sums[1] = similarity;
  }
}

// The loss has the same upstream gradient everywhere: it is multiplied in last.
template <bool kLoss>
void fill_gradients(const SsimTask& task, Ring<3>& ring, int y) {
  if (y < 0 || y >= task.height) return ring.clear(y);
  const int64_t start = int64_t(y) * ring.n;
  const float* const maps[3] = {task.d_mean + start, task.d_square + start, task.d_product + start};
  if (kLoss)
    for (int m = 0; m < 3; m++) __builtin_memcpy(ring.slot(m, y), maps[m], sizeof(float) * ring.n);
  for (int m = 0; m < 3 && !kLoss; m++) {
    float* const to = ring.slot(m, y);
    for (int i = 0; i < ring.n; i += kLanes) {
      const int count = ring.n - i;
      store_part(to + i, load_part(task.d_map + start + i, count) * load_part(maps[m] + i, count), count);
    }
  }
}

template <bool kLoss>
void gradient_row(const SsimTask& task, Ring<3>& ring, LossRow& loss, int y) {
  ring.blur_along_y(y);
  const int64_t start = int64_t(y) * ring.n;
  if (kLoss) loss.load_mask(task, y);
  for (int i = 0; i < ring.n; i += kLanes) {
    const int count = ring.n - i;
    const V x = load_part(task.image + start + i, count), t = load_part(task.target + start + i, count);
    V gradient = ring.blurred(0, i) + 2.0f * x * ring.blurred(1, i) + t * ring.blurred(2, i);
    if (kLoss) {
      const V sign = masked(x > t, broadcast(1.0f)) - masked(x < t, broadcast(1.0f));
      gradient = masked(load(loss.counts + i), task.by_similarity * gradient + task.by_difference * sign);
    }
    store_part(task.d_image + start + i, gradient, count);
  }
}

template <bool kLoss>
void gradient_band(const SsimTask& task) {
  Ring<3> ring(task);
  LossRow loss = {reinterpret_cast<int32_t*>(task.scratch + (kSsimScratchRows - 1) * ssim_row(task.width))};
  for (int y = task.first_row - kSsimRadius; y < task.last_row + kSsimRadius; y++) {
    fill_gradients<kLoss>(task, ring, y);
    if (y - kSsimRadius >= task.first_row) gradient_row<kLoss>(task, ring, loss, y - kSsimRadius);
  }
}

}  // namespace

void ssim(const SsimTask& task) { task.d_mean ? similarity_band<true, false>(task) : similarity_band<false, false>(task); }
void ssim_backward(const SsimTask& task) { gradient_band<false>(task); }
void l1_ssim(const SsimTask& task) { task.d_mean ? similarity_band<true, true>(task) : similarity_band<false, true>(task); }
void l1_ssim_backward(const SsimTask& task) { gradient_band<true>(task); }

}  // namespace dd::DD_ISA
