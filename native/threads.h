// A persistent pool of threads. Which thread runs a task must never matter for the result.
#pragma once
#include <cstdint>
#include <functional>

namespace dd {

int thread_count();
void set_thread_count(int count);  // at least 1

// Runs task(i, worker) for every i in [0, n), worker in [0, thread_count()). Several callers take turns.
void parallel_for(int64_t n, const std::function<void(int64_t, int)>& task);

}  // namespace dd
