// What this machine's cores can do at best, as JSON: fused multiply-adds, exponentials and copied bytes a second.
//
//     g++ -O3 -march=native -std=c++17 -pthread -o peaks peaks.cpp && ./peaks [THREADS]
//
// All threads start together on cores of their own; a round is as slow as its slowest thread, and the best of many short
// rounds counts, since on a shared machine the others are disturbed.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#if defined(__linux__)
#include <pthread.h>
#include <sched.h>
#endif

#if defined(__AVX512F__)
#define LANES 16
#elif defined(__AVX__)
#define LANES 8
#else
#define LANES 4
#endif

namespace {

using V = float __attribute__((vector_size(4 * LANES)));
using U = uint32_t __attribute__((vector_size(4 * LANES)));
using Clock = std::chrono::steady_clock;

constexpr int kRounds = 300;

// Cores this process may run on, one for each thread; empty where threads cannot be pinned.
std::vector<int> cores() {
  std::vector<int> out;
#if defined(__linux__)
  cpu_set_t set;
  if (sched_getaffinity(0, sizeof(set), &set) == 0)
    for (int core = 0; core < CPU_SETSIZE; core++)
      if (CPU_ISSET(core, &set)) out.push_back(core);
#endif
  return out;
}

void pin(int core) {
#if defined(__linux__)
  cpu_set_t set;
  CPU_ZERO(&set);
  CPU_SET(core, &set);
  pthread_setaffinity_np(pthread_self(), sizeof(set), &set);
#else
  (void)core;
#endif
}

// Seconds of the best round in which every thread runs task(thread, round) once.
double best_seconds(int threads, const std::function<void(int, int)>& task) {
  const std::vector<int> available = cores();
  std::atomic<int> ready{0}, done{0};
  double best = 1e30;
  auto serve = [&](int thread) {
    if (!available.empty()) pin(available[thread % available.size()]);
    for (int round = 0; round < kRounds; round++) {
      ready++;
      while (ready < threads * (round + 1)) std::this_thread::yield();
      const auto start = Clock::now();
      task(thread, round);
      done++;
      while (done < threads * (round + 1)) std::this_thread::yield();
      if (thread == 0) best = std::min(best, std::chrono::duration<double>(Clock::now() - start).count());
    }
  };
  std::vector<std::thread> pool;
  for (int thread = 0; thread < threads; thread++) pool.emplace_back(serve, thread);
  for (std::thread& thread : pool) thread.join();
  return best;
}

volatile float sink;

constexpr int kChains = 12;  // enough for two units of four cycles latency; with two constants they fit 16 registers
constexpr int64_t kFmaSteps = 100000;

void fma_task() {
  volatile float factor = 0.999f, offset = 0.001f;
  const V m = V{} + factor, c = V{} + offset;
  V a[kChains];
  for (int k = 0; k < kChains; k++) a[k] = V{} + float(k);
  for (int64_t i = 0; i < kFmaSteps; i++)
    for (int k = 0; k < kChains; k++) a[k] = a[k] * m + c;
  V sum = V{};
  for (int k = 0; k < kChains; k++) sum += a[k];
  sink = sum[0];
}

// 2^p by a polynomial of degree 5 on [-1/2, 1/2], exponent added as an integer: what the kernels use.
inline V exp2_bounded(V p) {
  const V shifter = V{} + 12582912.0f;
  const V t = p + shifter;
  const V f = p - (t - shifter);
  V r = 0.0013276471738f * f + 0.0096755415399f;
  r = r * f + 0.0555071327609f;
  r = r * f + 0.2402211972008f;
  r = r * f + 0.6931469670621f;
  r = r * f + 1.0000000716554f;
  return (V)((U)r + ((U)t << 23));
}

constexpr int kExpArray = 2048, kExpPasses = 700;  // in and out fit the first-level cache

void exp_task() {
  alignas(64) float in[kExpArray], out[kExpArray];
  for (int i = 0; i < kExpArray; i++) in[i] = -8.0f * float(i) / kExpArray;
  for (int pass = 0; pass < kExpPasses; pass++) {
    for (int i = 0; i < kExpArray; i += LANES) {
      V p;
      std::memcpy(&p, in + i, sizeof(p));
      p = exp2_bounded(p);
      std::memcpy(out + i, &p, sizeof(p));
    }
    asm volatile("" : : "r"(out) : "memory");
  }
  sink = out[0];
}

constexpr size_t kCopyBuffer = size_t(192) << 20, kCopyBytes = size_t(16) << 20;  // buffers far beyond the caches

}  // namespace

int main(int n, char** arguments) {
  const int threads = n > 1 ? std::max(1, std::atoi(arguments[1])) : std::max<int>(1, int(cores().size()));
  const double fma_s = best_seconds(threads, [](int, int) { fma_task(); });
  const double exp_s = best_seconds(threads, [](int, int) { exp_task(); });
  std::vector<std::vector<char>> from(threads), to(threads);
  for (int k = 0; k < threads; k++) {
    from[k].assign(kCopyBuffer, 1);
    to[k].assign(kCopyBuffer, 2);
  }
  const double copy_s = best_seconds(threads, [&](int thread, int round) {
    const size_t at = size_t(round) * kCopyBytes % kCopyBuffer;
    std::memcpy(to[thread].data() + at, from[thread].data() + at, kCopyBytes);
  });
  std::printf("{\"threads\": %d, \"lanes\": %d, \"fma_gflops_per_core\": %.1f, \"exp_g_per_core\": %.2f, "
              "\"copy_gb_per_s\": %.1f}\n",
              threads, LANES, 2e-9 * LANES * kChains * kFmaSteps / fma_s, 1e-9 * kExpArray * kExpPasses / exp_s,
              2e-9 * double(kCopyBytes) * threads / copy_s);
}
