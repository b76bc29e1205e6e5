// A row of float lanes as wide as the instruction set this file is compiled for.
#pragma once
#include <cstdint>

#if defined(__AVX2__)
#include <immintrin.h>
#endif

#if defined(__AVX512F__)
#define DD_LANES 16
#elif defined(__AVX__)
#define DD_LANES 8
#else
#define DD_LANES 4
#endif

namespace dd::DD_ISA {

constexpr int kLanes = DD_LANES;
using V = float __attribute__((vector_size(4 * DD_LANES)));
using I = int32_t __attribute__((vector_size(4 * DD_LANES)));
using U = uint32_t __attribute__((vector_size(4 * DD_LANES)));
using V4 = float __attribute__((vector_size(16)));

static inline V load(const float* p) {
  V v;
  __builtin_memcpy(&v, p, sizeof(v));
  return v;
}
static inline void store(float* p, V v) { __builtin_memcpy(p, &v, sizeof(v)); }
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
static inline I load(const int32_t* p) {
  I v;
  __builtin_memcpy(&v, p, sizeof(v));
  return v;
}
static inline void store(int32_t* p, I v) { __builtin_memcpy(p, &v, sizeof(v)); }

// p[i] in each lane.
static inline V gather(const float* p, I i) {
#if defined(__AVX512F__)
  return (V)_mm512_mask_i32gather_ps((__m512)V{}, 0xffff, (__m512i)i, p, 4);
#elif defined(__AVX2__)
  return (V)_mm256_i32gather_ps(p, (__m256i)i, 4);
#else
  V v;
  for (int l = 0; l < kLanes; l++) v[l] = p[i[l]];
  return v;
#endif
}

static inline V broadcast(float x) { return x - V{}; }
static inline I broadcast(int32_t x) { return x - I{}; }
static inline V iota() {
  V v;
  for (int l = 0; l < kLanes; l++) v[l] = float(l);
  return v;
}

static inline V vmin(V a, V b) { return a < b ? a : b; }
static inline V vmax(V a, V b) { return a > b ? a : b; }
static inline V masked(I mask, V v) { return (V)((I)v & mask); }
static inline V vabs(V v) { return (V)((I)v & 0x7fffffff); }

static inline V vsqrt(V v) {
  V r = V{};
  for (int l = 0; l < kLanes; l++) r[l] = __builtin_sqrtf(v[l]);
  return r;
}
static inline V vlog2(V v) {
  V r = V{};
  for (int l = 0; l < kLanes; l++) r[l] = __builtin_log2f(v[l]);
  return r;
}

// One bit for each lane of a mask.
static inline uint32_t bits(I mask) {
#if DD_LANES == 16
  return uint16_t(__builtin_ia32_cvtd2mask512(mask));
#elif DD_LANES == 8
  return uint32_t(__builtin_ia32_movmskps256((V)mask));
#elif defined(__SSE__)
  return uint32_t(__builtin_ia32_movmskps((V)mask));
#else
  uint32_t out = 0;
  for (int l = 0; l < kLanes; l++) out |= (uint32_t(mask[l]) & 1u) << l;
  return out;
#endif
}
static inline bool any(I mask) { return bits(mask) != 0; }

// 2^p for -126 < p < 127, relative error below 2e-7; lanes outside hold garbage that the caller masks.
// The constants are the minimax polynomial of degree 5 on [-1/2, 1/2].
static inline V exp2_bounded(V p) {
  const V shifter = broadcast(12582912.0f);  // 1.5 * 2^23: adding it leaves the rounded integer in the low bits
  const V t = p + shifter;
  const V f = p - (t - shifter);
  const V ff = f * f;
  V high = 0.0013276471738f * f + 0.0096755415399f;
  const V middle = 0.0555071327609f * f + 0.2402211972008f, low = 0.6931469670621f * f + 1.0000000716554f;
  high = high * ff + middle;
  const V r = high * ff + low;
  return (V)((U)r + ((U)t << 23));
}

// The sums over the lanes of four vectors, as one vector of four.
static inline V4 halves(V v) {
#if DD_LANES == 4
  return v;
#else
  V4 part[DD_LANES / 4];
  __builtin_memcpy(part, &v, sizeof(v));
  V4 sum = part[0] + part[1];
  for (int k = 2; k < DD_LANES / 4; k += 2) sum += part[k] + part[k + 1];
  return sum;
#endif
}
static inline V4 sum_lanes(V a, V b, V c, V d) {
  const V4 p = halves(a), q = halves(b), r = halves(c), s = halves(d);
  const V4 pq = __builtin_shufflevector(p, q, 0, 4, 1, 5) + __builtin_shufflevector(p, q, 2, 6, 3, 7);
  const V4 rs = __builtin_shufflevector(r, s, 0, 4, 1, 5) + __builtin_shufflevector(r, s, 2, 6, 3, 7);
  return __builtin_shufflevector(pq, rs, 0, 1, 4, 5) + __builtin_shufflevector(pq, rs, 2, 3, 6, 7);
}
static inline float sum_lanes(V v) {
  const V4 h = halves(v);
  return (h[0] + h[2]) + (h[1] + h[3]);
}

}  // namespace dd::DD_ISA
