// Semi-global smoothing (Hirschmueller, 2008) along rows and columns, both ways.
#include "kernel_list.h"
#include "lanes.h"

namespace dd::DD_ISA {
namespace {

constexpr float kInfinite = __builtin_inff();

// One pixel along all paths of a row of pixels: stay, change by one label, or jump. `path` and `to` are (labels, w),
// `least` of every column of the path becomes that of the one it goes on as.
void step_down(const SmoothTask& task, const float* path, const float* cost, const float* jump, float* least,
               float* next, float* to) {
  const int w = task.width;
  for (int x = 0; x < w; x++) next[x] = kInfinite;
  for (int l = 0; l < task.labels; l++) {
    const float* here = path + int64_t(l) * w;
    const float* below = l > 0 ? here - w : here;
    const float* above = l + 1 < task.labels ? here + w : here;
    const float* costs = cost + int64_t(l) * w;
    float* out = to + int64_t(l) * w;
    for (int x = 0; x < w; x += kLanes) {
      const int n = w - x;
      const V lowest = load_part(least + x, n);
      const V beside = vmin(load_part(below + x, n), load_part(above + x, n)) + task.step;
      const V reached = vmin(vmin(load_part(here + x, n), lowest + load_part(jump + x, n)), beside);
      const V now = (reached + load_part(costs + x, n)) - lowest;
      store_part(out + x, now, n);
      store_part(next + x, vmin(load_part(next + x, n), now), n);
    }
  }
  __builtin_memcpy(least, next, sizeof(float) * w);
}

void start_down(const SmoothTask& task, const float* cost, float* least, float* to) {
  const int w = task.width;
  __builtin_memcpy(to, cost, sizeof(float) * w * task.labels);
  __builtin_memcpy(least, cost, sizeof(float) * w);
  for (int l = 1; l < task.labels; l++)
    for (int x = 0; x < w; x++) least[x] = least[x] < cost[int64_t(l) * w + x] ? least[x] : cost[int64_t(l) * w + x];
}

static inline float least_lane(V v) {
  float least = v[0];
  for (int l = 1; l < kLanes; l++) least = least < v[l] ? least : v[l];
  return least;
}

// The labels of one pixel after the other along a row: between infinite ones, so that the first and the last have no
// neighbour beyond them.
struct Along {
  int labels;
  float *path, *next;

  Along(int labels, float* scratch) : labels(labels), path(scratch + 16), next(path + labels + 32) {
    for (int k = 0; k < 16; k++) path[-1 - k] = next[-1 - k] = path[labels + k] = next[labels + k] = kInfinite;
  }
  float start(const float* cost) {
    V least = broadcast(kInfinite);
    for (int l = 0; l < labels; l += kLanes) {
      store(path + l, load(cost + l));
      least = vmin(least, load(cost + l));
    }
    return least_lane(least);
  }
  float step(const float* cost, float jump, float least, float by_one) {
    const V far = broadcast(least + jump);
    V lowest = broadcast(kInfinite);
    for (int l = 0; l < labels; l += kLanes) {
      const V beside = vmin(load(path + l - 1), load(path + l + 1)) + by_one;
      const V now = (vmin(vmin(load(path + l), far), beside) + load(cost + l)) - least;
      store(next + l, now);
      lowest = vmin(lowest, now);
    }
    float* swapped = path;
    path = next;
    next = swapped;
    return least_lane(lowest);
  }
};

void transposed(const float* from, const float* more, int labels, int width, int stride, float* to) {
  for (int x = 0; x < width; x++) {
    for (int l = 0; l < labels; l++) {
      const int64_t at = int64_t(l) * width + x;
      to[int64_t(x) * stride + l] = more ? from[at] + more[at] : from[at];
    }
    for (int l = labels; l < stride; l++) to[int64_t(x) * stride + l] = kInfinite;
  }
}

// The first of the least labels, between its neighbours by the parabola through the three.
float cheapest(const float* total, int labels) {
  int best = 0;
  for (int l = 1; l < labels; l++) best = total[l] < total[best] ? l : best;
  if (best == 0 || best == labels - 1) return float(best);
  const float low = total[best - 1], mid = total[best], high = total[best + 1];
  const float curvature = low - 2.0f * mid + high;
  if (!(curvature > 1e-6f)) return float(best);
  const float shift = (low - high) / (2.0f * curvature);
  return float(best) + (shift < -0.5f ? -0.5f : shift > 0.5f ? 0.5f : shift);
}

}  // namespace

void smooth(const SmoothTask& task) {
  const int w = task.width, h = task.height, labels = task.labels, stride = padded_labels(labels);
  const int64_t slice = int64_t(labels) * w;
  float *up = task.scratch, *up_next = up + slice, *least = up_next + slice, *next = least + w;
  float *costs = next + w, *sums = costs + int64_t(w) * stride, *right = sums + int64_t(w) * stride;
  Along along(stride, right + int64_t(w) * stride);
  start_down(task, task.cost, least, task.total);
  for (int y = 1; y < h; y++)
    step_down(task, task.total + (y - 1) * slice, task.cost + y * slice, task.jump_down + int64_t(y - 1) * w, least, next,
              task.total + y * slice);
  for (int y = h - 1; y >= 0; y--) {
    const float* cost = task.cost + y * slice;
    if (y == h - 1) {
      start_down(task, cost, least, up);
    } else {
      step_down(task, up, cost, task.jump_down + int64_t(y) * w, least, next, up_next);
      float* swapped = up;
      up = up_next;
      up_next = swapped;
    }
    transposed(cost, nullptr, labels, w, stride, costs);
    transposed(task.total + y * slice, up, labels, w, stride, sums);
    const float* jump = task.jump_right + int64_t(y) * (w - 1);
    float lowest = along.start(costs);
    for (int x = 0;; x++) {
      __builtin_memcpy(right + int64_t(x) * stride, along.path, sizeof(float) * stride);
      if (x == w - 1) break;
      lowest = along.step(costs + int64_t(x + 1) * stride, jump[x], lowest, task.step);
    }
    lowest = along.start(costs + int64_t(w - 1) * stride);
    for (int x = w - 1;; x--) {
      float* sum = sums + int64_t(x) * stride;
      for (int l = 0; l < labels; l += kLanes)
        store(sum + l, load(sum + l) + (load(right + int64_t(x) * stride + l) + load(along.path + l)));
      task.label[int64_t(y) * w + x] = cheapest(sum, labels);
      if (x == 0) break;
      lowest = along.step(costs + int64_t(x - 1) * stride, jump[x - 1], lowest, task.step);
    }
  }
}

}  // namespace dd::DD_ISA
