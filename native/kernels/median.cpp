// Weighted medians of columns, a row of lanes at a time.
#include "kernel_list.h"
#include "lanes.h"

namespace dd::DD_ISA {

void weighted_median(const MedianTask& task) {
  const int n = task.count;
  float *values = task.scratch, *weights = values + n * kLanes;
  const auto order = [&](int a, int b) {
    const V first = load(values + a * kLanes), second = load(values + b * kLanes);
    const V light = load(weights + a * kLanes), heavy = load(weights + b * kLanes);
    const I swap = first > second;
    store(values + a * kLanes, swap ? second : first);
    store(values + b * kLanes, swap ? first : second);
    store(weights + a * kLanes, swap ? heavy : light);
    store(weights + b * kLanes, swap ? light : heavy);
  };
  for (int64_t x = 0; x < task.columns; x += kLanes) {
    const int columns = int(task.columns - x < kLanes ? task.columns - x : kLanes);
    for (int i = 0; i < n; i++) {
      store(values + i * kLanes, load_part(task.values + i * task.columns + x, columns));
      store(weights + i * kLanes, load_part(task.weights + i * task.columns + x, columns));
    }
    // Batcher's odd-even merge sort: which are compared does not depend on the values.
    for (int p = 1; p < n; p *= 2)
      for (int k = p; k >= 1; k /= 2)
        for (int j = k % p; j + k < n; j += 2 * k)
          for (int i = j; i < j + k && i + k < n; i++)
            if (i / (2 * p) == (i + k) / (2 * p)) order(i, i + k);
    V total = V{};
    for (int i = 0; i < n; i++) {
      total += load(weights + i * kLanes);
      store(weights + i * kLanes, total);
    }
    const V half = total * 0.5f;
    V found = load(values + (n - 1) * kLanes);
    for (int i = n - 1; i >= 0; i--) found = load(weights + i * kLanes) >= half ? load(values + i * kLanes) : found;
    store_part(task.out + x, found, columns);
  }
}

}  // namespace dd::DD_ISA
