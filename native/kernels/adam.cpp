// Adam (Kingma and Ba 2015) on a stretch of one tensor.
#include "kernel_list.h"
#include "lanes.h"

namespace dd::DD_ISA {

void adam(const AdamTask& task) {
  // The step sizes of kLanes elements in a row repeat after `columns` such rows.
  V rates[kMostColumns];
  for (int c = 0; c < task.columns; c++)
    for (int l = 0; l < kLanes; l++) rates[c][l] = task.scale_mean * task.rates[(c * kLanes + l) % task.columns];
  int column = 0;
  for (int64_t i = task.first; i < task.last; i += kLanes) {
    const int count = int(task.last - i < kLanes ? task.last - i : kLanes);
    const V gradient = load_part(task.gradient + i, count);
    const V old_mean = load_part(task.mean + i, count), old_square = load_part(task.square + i, count);
    const V mean = old_mean + task.new_mean * (gradient - old_mean);
    const V square = task.keep_square * old_square + task.new_square * gradient * gradient;
    const V step = rates[column] * mean / (vsqrt(square) * task.scale_root + task.epsilon);
    store_part(task.mean + i, mean, count);
    store_part(task.square + i, square, count);
    store_part(task.value + i, load_part(task.value + i, count) - step, count);
    if (++column == task.columns) column = 0;
  }
}

}  // namespace dd::DD_ISA
