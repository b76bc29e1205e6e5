// Plane sweep: how well the sources fit the reference as if all of it were on one plane after the other. They are sampled
// bilinearly with their edges repeated; windows reach over edges by reflection about the last pixel.
#include "kernel_list.h"
#include "lanes.h"

namespace dd::DD_ISA {
namespace {

constexpr float kUnseen = -2.0f;                // below every correlation

static inline int reflected(int i, int count) {
  if (count == 1) return 0;
  while (i < 0 || i >= count) i = i < 0 ? -i : 2 * count - 2 - i;
  return i;
}

// A row of a source on the reference's grid, and 1 where the source sees it, else 0.
void warp_row(const SweepTask& task, const SweepSource& source, int label, int y, float* grey, float* seen) {
  const double* h = source.homographies + 9 * label;
  const int w = task.width;
  const float u0 = float(h[1] * y + h[2]), v0 = float(h[4] * y + h[5]), z0 = float(h[7] * y + h[8]);
  const float right = float(w - 1), bottom = float(task.height - 1);
  const I last_column = broadcast(int32_t(w - 2)), last_row = broadcast(int32_t(task.height - 2));
  for (int x = 0; x < w; x += kLanes) {
    const V column = iota() + float(x);
    const V z = float(h[6]) * column + z0, inverse = 1.0f / z;
    const V u = (float(h[0]) * column + u0) * inverse, v = (float(h[3]) * column + v0) * inverse;
    const V within_u = vmin(vmax(u, V{}), broadcast(right)), within_v = vmin(vmax(v, V{}), broadcast(bottom));
    I i = __builtin_convertvector(within_u, I), j = __builtin_convertvector(within_v, I);
    i = i < last_column ? i : last_column;
    j = j < last_row ? j : last_row;
    const V along = within_u - __builtin_convertvector(i, V), down = within_v - __builtin_convertvector(j, V);
    const I at = j * w + i;
    const V a = gather(source.grey, at), b = gather(source.grey + 1, at);
    const V c = gather(source.grey + w, at), d = gather(source.grey + w + 1, at);
    const V top = a + along * (b - a), below = c + along * (d - c);
    store(grey + x, top + down * (below - top) - task.centre);
    const I inside = (u >= -0.5f) & (u < right + 0.5f) & (v >= -0.5f) & (v < bottom + 0.5f) & (z > task.least_z);
    V counts = broadcast(1.0f);
    if (source.usable) {
      const I nearest = __builtin_convertvector(within_v + 0.5f, I) * w + __builtin_convertvector(within_u + 0.5f, I);
      counts = gather(source.usable, nearest);
    }
    store(seen + x, masked(inside, counts));
  }
}

// Sums along rows of a source, of its square and of its product with the reference, for as many rows as the window has.
struct Windows {
  float* rows;
  int side, stride;
  float* slot(int y, int map) const { return rows + (int64_t(y % side) * 4 + map) * stride; }
  float* seen(int y) const { return slot(y, 3); }
};

struct Correlating {
  const SweepTask& task;
  int radius, stride;
  float *reference, *row, *square, *product;

  explicit Correlating(const SweepTask& task)
      : task(task), radius(task.side / 2), stride(sweep_row(task.width, task.side)), reference(task.scratch),
        row(reference + stride), square(row + stride), product(square + stride) {}

  Windows windows(int source) const {
    return {task.scratch + int64_t(stride) * (4 + 4 * task.side * source), task.side, stride};
  }
  void reach_over(float* padded) const {
    for (int k = 1; k <= radius; k++) {
      padded[radius - k] = padded[radius + reflected(-k, task.width)];
      padded[radius + task.width - 1 + k] = padded[radius + reflected(task.width - 1 + k, task.width)];
    }
  }
  void add_row(int label, int y) {
    for (int x = 0; x < task.width; x++) reference[radius + x] = task.grey[int64_t(y) * task.width + x];
    reach_over(reference);
    for (int s = 0; s < task.n_sources; s++) {
      const Windows to = windows(s);
      warp_row(task, task.sources[s], label, y, row + radius, to.seen(y));
      reach_over(row);
      for (int x = 0; x < stride; x += kLanes) {
        const V other = load(row + x);
        store(square + x, other * other);
        store(product + x, load(reference + x) * other);
      }
      const float* const maps[3] = {row, square, product};
      for (int map = 0; map < 3; map++) {
        float* sums = to.slot(y, map);
        for (int x = 0; x < task.width; x += kLanes) {
          V sum = load(maps[map] + x);
          for (int k = 1; k < task.side; k++) sum += load(maps[map] + x + k);
          store(sums + x, sum);
        }
      }
    }
  }
  // Takes the correlations of a source with row y of the reference into the best two of each pixel.
  void add_scores(const Windows& of, int y, float* best, float* second) const {
    const float* from[kMostSide];
    for (int k = 0; k < task.side; k++) from[k] = of.slot(reflected(y + k - radius, task.height), 0);
    const int64_t row_at = int64_t(y) * task.width;
    const float *seen = of.seen(y), *means = task.mean + row_at, *variances = task.variance + row_at;
    const float share = 1.0f / float(task.side * task.side);
    for (int x = 0; x < task.width; x += kLanes) {
      V sums[3] = {};
      for (int k = 0; k < task.side; k++)
        for (int map = 0; map < 3; map++) sums[map] += load(from[k] + map * stride + x);
      const V mean = load_part(means + x, task.width - x), variance = load_part(variances + x, task.width - x);
      const V other = sums[0] * share, spread = vmax(sums[1] * share - other * other, V{}) + task.noise;
      V score = (sums[2] * share - mean * other) / vsqrt(spread * (variance + task.noise));
      score = load(seen + x) > V{} ? score : broadcast(kUnseen);
      store(second + x, vmax(load(second + x), vmin(load(best + x), score)));
      store(best + x, vmax(load(best + x), score));
    }
  }
};

}  // namespace

void sweep_cost(const SweepTask& task) {
  Correlating correlating(task);
  const int w = task.width, ahead = correlating.radius;
  float *best = correlating.windows(task.n_sources).rows, *second = best + correlating.stride;
  __builtin_memset(task.scratch, 0, sizeof(float) * sweep_scratch(w, task.side, task.n_sources));
  for (int label = 0; label < task.labels; label++) {
    for (int y = 0; y < ahead && y < task.height; y++) correlating.add_row(label, y);
    for (int y = 0; y < task.height; y++) {
      if (y + ahead < task.height) correlating.add_row(label, y + ahead);
      for (int x = 0; x < w; x += kLanes) {
        store(best + x, broadcast(kUnseen));
        store(second + x, broadcast(kUnseen));
      }
      for (int s = 0; s < task.n_sources; s++) correlating.add_scores(correlating.windows(s), y, best, second);
      float* out = task.out + (int64_t(y) * task.labels + label) * w;
      for (int x = 0; x < w; x += kLanes) {
        const V one = load(best + x), other = load(second + x);
        const V found = other > kUnseen ? (one + other) * 0.5f : one;
        store_part(out + x, 1.0f - masked(one > kUnseen, found), w - x);
      }
    }
  }
}

void sweep_misfit(const SweepTask& task) {
  const int w = task.width;
  const int stride = sweep_row(w, 1);
  float *grey = task.scratch, *seen = grey + stride, *total = seen + stride, *count = total + stride;
  for (int label = 0; label < task.labels; label++)
    for (int y = 0; y < task.height; y++) {
      for (int x = 0; x < w; x += kLanes) {
        store(total + x, V{});
        store(count + x, V{});
      }
      const float* reference = task.grey + int64_t(y) * w;
      for (int s = 0; s < task.n_sources; s++) {
        warp_row(task, task.sources[s], label, y, grey, seen);
        for (int x = 0; x < w; x += kLanes) {
          const V by = vmin(vabs(load(grey + x) - load_part(reference + x, w - x)), broadcast(task.most));
          store(total + x, load(total + x) + by * load(seen + x));
          store(count + x, load(count + x) + load(seen + x));
        }
      }
      float* out = task.out + (int64_t(label) * task.height + y) * w;
      for (int x = 0; x < w; x += kLanes) {
        const V by = load(count + x);
        store_part(out + x, by > V{} ? load(total + x) / by : broadcast(task.most), w - x);
      }
    }
}

}  // namespace dd::DD_ISA
