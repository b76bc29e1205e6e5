// Chooses the kernels for the machine at hand; DREAMDRIVE_ISA=baseline|avx2|avx512 overrides, for tests.
#include <cstdlib>
#include <stdexcept>
#include <string>

#include "kernels/types.h"

namespace dd {

namespace baseline {
extern const Kernels kTable;
}
#if defined(DD_X86)
namespace avx2 {
extern const Kernels kTable;
}
namespace avx512 {
extern const Kernels kTable;
}
#endif

namespace {

struct Candidate {
  const char* name;
  const Kernels* table;
  bool usable;
};

const Kernels& choose() {
#if defined(DD_X86)
  __builtin_cpu_init();
  const bool has_avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
                        __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2");
  const bool has_avx512 = has_avx2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
                          __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512bw");
  const Candidate candidates[] = {
      {"avx512", &avx512::kTable, has_avx512}, {"avx2", &avx2::kTable, has_avx2}, {"baseline", &baseline::kTable, true}};
#else
  const Candidate candidates[] = {{"baseline", &baseline::kTable, true}};
#endif
  const char* wanted = std::getenv("DREAMDRIVE_ISA");
  for (const Candidate& candidate : candidates) {
    if (wanted && *wanted && std::string(wanted) != candidate.name) continue;
    if (candidate.usable) return *candidate.table;
    if (wanted && *wanted) throw std::runtime_error(std::string("DREAMDRIVE_ISA=") + wanted + ": this machine lacks it");
  }
  throw std::runtime_error(std::string("DREAMDRIVE_ISA=") + wanted + ": expected baseline, avx2 or avx512 (x86 only)");
}

}  // namespace

const Kernels& kernels() {
  static const Kernels& chosen = choose();
  return chosen;
}

}  // namespace dd
