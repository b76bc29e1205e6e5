// From the parameters a fit learns to those splatting takes: exp of the scales, sigmoid of the opacities.
#include "kernel_list.h"
#include "lanes.h"

namespace dd::DD_ISA {
namespace {

// Within two units in the last place where the result is a normal number; the polynomial is that of Cephes' expf.
static inline V exponential(V x) {
  const V shifter = broadcast(12582912.0f);  // 1.5 * 2^23: adding it leaves the rounded integer in the low bits
  const V bounded = vmin(vmax(x, broadcast(-87.0f)), broadcast(88.37f));
  const V shifted = bounded * 1.44269504088896f + shifter, n = shifted - shifter;
  const V r = (bounded - n * 0.693359375f) + n * 2.12194440e-4f;
  V y = 1.9875691500e-4f * r + 1.3981999507e-3f;
  y = y * r + 8.3334519073e-3f;
  y = y * r + 4.1665795894e-2f;
  y = y * r + 1.6666665459e-1f;
  y = y * r + 5.0000001201e-1f;
  y = y * (r * r) + r + 1.0f;
  y = (V)((U)y + ((U)shifted << 23));
  y = x > 88.37f ? broadcast(__builtin_inff()) : y;
  return x == x ? y : x;
}

}  // namespace

void activate(const ActivationTask& task) {
  const int64_t first = task.first, rows = task.last - first, to = task.to + first;
  float* means = task.out_means + 3 * to;
  __builtin_memcpy(means, task.means + 3 * first, sizeof(float) * 3 * rows);
  if (task.offsets)
    for (int64_t i = 0; i < rows; i++)
      for (int k = 0; k < 3; k++) means[3 * i + k] += task.unit[first + i] * task.offsets[3 * (first + i) + k];
  __builtin_memcpy(task.out_quaternions + 4 * to, task.quaternions + 4 * first, sizeof(float) * 4 * rows);
  __builtin_memcpy(task.out_sh + task.sh_size * to, task.sh + task.sh_size * first, sizeof(float) * task.sh_size * rows);
  for (int64_t i = 0; i < 3 * rows; i += kLanes) {
    const int count = int(3 * rows - i < kLanes ? 3 * rows - i : kLanes);
    store_part(task.scales + 3 * to + i, exponential(load_part(task.log_scales + 3 * first + i, count)), count);
  }
  for (int64_t i = 0; i < rows; i += kLanes) {
    const int count = int(rows - i < kLanes ? rows - i : kLanes);
    const V logit = load_part(task.logits + first + i, count);
    store_part(task.opacities + to + i, 1.0f / (1.0f + exponential(-logit)), count);
  }
}

void activate_backward(const ActivationTask& task) {
  const int64_t first = task.first, rows = task.last - first, to = task.to + first;
  if (task.d_offsets)
    for (int64_t i = 0; i < rows; i++)
      for (int k = 0; k < 3; k++)
        task.d_offsets[3 * (first + i) + k] = task.unit[first + i] * task.d_means[3 * (to + i) + k];
  for (int64_t i = 0; i < 3 * rows; i++)
    task.d_log_scales[3 * first + i] = task.scales[3 * to + i] * task.d_scales[3 * to + i];
  for (int64_t i = 0; i < rows; i++) {
    const float opacity = task.opacities[to + i];
    task.d_logits[first + i] = task.d_opacities[to + i] * opacity * (1.0f - opacity);
  }
}

}  // namespace dd::DD_ISA
