// What the bindings of a training step share: arrays in and out, and work in parts that do not depend on the threads.
#pragma once
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "core/threads.h"

namespace nb = nanobind;
using namespace nb::literals;

using In = nb::ndarray<const float, nb::c_contig, nb::device::cpu>;
using Out = nb::ndarray<float, nb::c_contig, nb::device::cpu>;

inline void expect_size(const char* name, size_t size, size_t expected) {
  if (size != expected)
    throw nb::value_error((std::string(name) + ": expected " + std::to_string(expected) + " numbers, got " +
                           std::to_string(size)).c_str());
}

inline const float* pointer(const std::optional<In>& array) { return array ? array->data() : nullptr; }
inline float* pointer(std::optional<Out>& array) { return array ? array->data() : nullptr; }

// Calls run(first, last, part) for stretches of [0, count); which they are does not depend on the threads.
template <class Run>
void in_parts(int64_t count, int64_t part_size, const Run& run) {
  dd::parallel_for((count + part_size - 1) / part_size, [&](int64_t part, int) {
    run(part * part_size, std::min(count, (part + 1) * part_size), part);
  });
}

// Sums of each part, added in order.
template <size_t kCount>
struct PartSums {
  std::vector<std::array<double, kCount>> parts;
  explicit PartSums(int64_t count) : parts(count) {}
  double* of(int64_t part) { return parts[part].data(); }
  std::array<double, kCount> total() const {
    std::array<double, kCount> sum = {};
    for (const auto& part : parts)
      for (size_t k = 0; k < kCount; k++) sum[k] += part[k];
    return sum;
  }
};

// Arrays are taken as they are: a converted copy of an output would be lost.
inline auto array(const char* name) { return nb::arg(name).noconvert(); }
inline auto maybe(const char* name) { return nb::arg(name).noconvert().none(); }
