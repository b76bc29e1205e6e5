// What the restorer makes of its network's answer: pixels mixed from their surroundings in several pictures.
#include "kernel_list.h"
#include "lanes.h"

namespace dd::DD_ISA {

constexpr float kLog2E = 1.4426950408889634f;

static inline V vexp(V x) { return exp2_bounded(vmax(vmin(x * kLog2E, broadcast(120.0f)), broadcast(-120.0f))); }
static inline V vtanh(V x) { return 1.0f - 2.0f / (vexp(2.0f * x) + 1.0f); }

// Shares are proportional to how sure a place is times exp(logit); what sharpens adds differences from the pixel itself.
void mix(const MixTask& task) {
  const int width = task.width, wide = width + 2 * task.reach;
  const int64_t plane = int64_t(task.height) * width, wide_plane = int64_t(task.height + 2 * task.reach) * wide;
  for (int y = task.first; y < task.last; y++) {
    for (int x = 0; x < width; x += kLanes) {
      const int count = width - x < kLanes ? width - x : kLanes;
      const float* answer = task.answer + int64_t(y) * width + x;
      const float* here = task.pictures + int64_t(y + task.reach) * wide + x + task.reach;
      const auto logit = [&](int k) {
        const V said = load_part(answer + k * plane, count);
        return k ? said : said + task.own;
      };
      V most = logit(0);
      for (int k = 1; k < task.taps; k++) most = vmax(most, logit(k));
      V total = V{}, sums[3] = {};
      for (int k = 0; k < task.taps; k++) {
        const int32_t* tap = task.tap + 3 * k;
        const float* there = here + 4 * tap[0] * wide_plane + tap[1] * wide + tap[2];
        const V share = vexp(logit(k) - most) * load_part(there + 3 * wide_plane, count);
        total += share;
        for (int c = 0; c < 3; c++) sums[c] += share * load_part(there + c * wide_plane, count);
      }
      for (int c = 0; c < 3; c++) sums[c] /= total;
      for (int k = 0; k < task.details; k++) {
        const int32_t* shift = task.detail + 2 * k;
        const float* there = here + shift[0] * wide + shift[1];
        const V signed_share = load_part(answer + (task.taps + k) * plane, count);
        const V share = task.most_detail * vtanh(signed_share / task.gentle);
        for (int c = 0; c < 3; c++)
          sums[c] += share * (load_part(there + c * wide_plane, count) - load_part(here + c * wide_plane, count));
      }
      for (int c = 0; c < 3; c++) store_part(task.mixed + c * plane + int64_t(y) * width + x, sums[c], count);
    }
  }
}

}  // namespace dd::DD_ISA
