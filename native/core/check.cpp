#include "check.h"

#include <algorithm>
#include <atomic>
#include <cstring>

#include "threads.h"

namespace dd {
namespace {

constexpr int64_t kBlock = 4096;                  // Gaussians of one task
constexpr float kLargest = 1e30f;                 // so that products with a weight or an upstream gradient stay finite
constexpr float kShortest = 1e-12f, kLongest = 1e18f;

// Positive floats are ordered like their bits, and NaN lies above them all: integer comparisons, which compilers turn
// into vectors for any instruction set. Adding zero makes -0 positive.
int32_t bits_of(float x) {
  x += 0.0f;
  int32_t bits;
  std::memcpy(&bits, &x, 4);
  return bits;
}

bool all_finite(const float* x, int64_t n) {
  const int32_t limit = bits_of(kLargest);
  int32_t bad = 0;
  for (int64_t i = 0; i < n; i++) {
    int32_t bits;
    std::memcpy(&bits, x + i, 4);
    bad |= int32_t((bits & 0x7fffffff) > limit);
  }
  return !bad;
}

bool all_from_zero_to(float most, const float* x, int64_t n) {
  const int32_t limit = bits_of(most);
  int32_t bad = 0;
  for (int64_t i = 0; i < n; i++) {
    const int32_t bits = bits_of(x[i]);
    bad |= int32_t(bits > limit) | int32_t(bits < 0);
  }
  return !bad;
}

bool all_rotations(const float* q, int64_t n) {
  const int32_t low = bits_of(kShortest * kShortest), high = bits_of(kLongest * kLongest);
  int32_t bad = 0;
  for (int64_t i = 0; i < n; i++, q += 4) {
    const int32_t bits = bits_of(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    bad |= int32_t(bits < low) | int32_t(bits > high);
  }
  return !bad;
}

}  // namespace

bool all_usable(const Inputs& in) {
  std::atomic<bool> usable{true};
  const int64_t sh = 3 * in.sh_stored, channels = in.n_channels;
  parallel_for((in.n + kBlock - 1) / kBlock, [&](int64_t block, int) {
    const int64_t i = block * kBlock, n = std::min(in.n - i, kBlock);
    const bool good = all_finite(in.means + 3 * i, 3 * n) && all_rotations(in.quaternions + 4 * i, n) &&
                      all_from_zero_to(kLargest, in.scales + 3 * i, 3 * n) &&
                      all_from_zero_to(1.0f, in.opacities + i, n) && all_finite(in.sh + sh * i, sh * n) &&
                      (!in.channels || all_finite(in.channels + channels * i, channels * n)) &&
                      (!in.offsets || all_finite(in.offsets + 2 * i, 2 * n));
    if (!good) usable = false;
  });
  return usable;
}

}  // namespace dd
