// What a training step does with each pixel by itself.
#include "kernel_list.h"
#include "lanes.h"

namespace dd::DD_ISA {

// picture = A (colour + (1 - alpha) sky) + b, with affine = [A | b].
void over_sky(const PictureTask& task) {
  const float* m = task.affine;
  for (int64_t i = task.first; i < task.last; i++) {
    const float clear = 1.0f - task.alpha[i];
    float rgb[3];
    for (int c = 0; c < 3; c++) rgb[c] = task.colour[3 * i + c] + clear * task.sky[3 * i + c];
    for (int r = 0; r < 3; r++)
      task.picture[3 * i + r] = m[4 * r] * rgb[0] + m[4 * r + 1] * rgb[1] + m[4 * r + 2] * rgb[2] + m[4 * r + 3];
  }
}

// The gradients of up to kLanes pixels; sums of each lane apart.
static inline void picture_gradients(const float* m, const float* __restrict colour, const float* __restrict alpha,
                                     const float* __restrict sky, const float* __restrict up,
                                     float* __restrict d_colour, float* __restrict d_alpha,
                                     float (*__restrict sums)[kLanes], int count) {
  for (int l = 0; l < count; l++) {
    float towards_sky = 0;
    for (int c = 0; c < 3; c++) {
      const float rgb = colour[3 * l + c] + (1.0f - alpha[l]) * sky[3 * l + c];
      const float d_rgb = m[c] * up[3 * l] + m[4 + c] * up[3 * l + 1] + m[8 + c] * up[3 * l + 2];
      for (int r = 0; r < 3; r++) sums[4 * r + c][l] += up[3 * l + r] * rgb;
      towards_sky += d_rgb * sky[3 * l + c];
      d_colour[3 * l + c] = d_rgb;
    }
    for (int r = 0; r < 3; r++) sums[4 * r + 3][l] += up[3 * l + r];
    d_alpha[l] = -towards_sky;
  }
}

void over_sky_backward(const PictureTask& task) {
  float sums[12][kLanes] = {};
  int64_t i = task.first;
  for (; i + kLanes <= task.last; i += kLanes)
    picture_gradients(task.affine, task.colour + 3 * i, task.alpha + i, task.sky + 3 * i, task.d_picture + 3 * i,
                      task.d_colour + 3 * i, task.d_alpha + i, sums, kLanes);
  picture_gradients(task.affine, task.colour + 3 * i, task.alpha + i, task.sky + 3 * i, task.d_picture + 3 * i,
                    task.d_colour + 3 * i, task.d_alpha + i, sums, int(task.last - i));
  for (int k = 0; k < 12; k++) task.d_affine[k] = sum_lanes(load(sums[k]));
}

void geometry_loss(const GeometryLossTask& task) {
  const V least = broadcast(kLeastCover), one = broadcast(1.0f), zero = V{};
  V disparity = V{}, coverage = V{};
  for (int64_t i = task.first; i < task.last; i += kLanes) {
    const int count = int(task.last - i < kLanes ? task.last - i : kLanes);
    const V depth = load_part(task.depth_sum + i, count), alpha = load_part(task.alpha + i, count);
    const V weight = load_part(task.weight + i, count), reference = load_part(task.reference + i, count);
    V sky = V{};
    for (int l = 0; l < kLanes && l < count; l++) sky[l] = float(task.sky[i + l]);
    const V deep = vmax(depth, least), inverse = vmax(alpha, least) / deep;
    const V away = masked(weight > zero, inverse - one / vmax(reference, least));
    disparity += weight * vabs(away);
    coverage += alpha * sky;
    if (!task.d_alpha) continue;
    const V sign = masked(away > zero, one) - masked(away < zero, one);
    const V by_inverse = task.by_disparity * weight * sign / deep;
    store_part(task.d_depth_sum + i, masked(depth >= least, -by_inverse * inverse), count);
    store_part(task.d_alpha + i, masked(alpha >= least, by_inverse) + task.by_coverage * sky, count);
  }
  task.sums[0] = sum_lanes(disparity);
  task.sums[1] = sum_lanes(coverage);
}

}  // namespace dd::DD_ISA
