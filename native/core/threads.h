// A persistent pool of threads. Which thread runs a task must never matter for the result.
#pragma once
#include <cstdint>
#include <functional>

namespace dd {

int thread_count();
void set_thread_count(int count);  // at least 1

// Runs task(i, worker) for every i in [0, n), worker in [0, workers). Several callers take turns. What a task throws is
// thrown here once all threads are done; parts that had not begun are left out. Who has memory of its own for each worker
// says for how many: another thread may have changed the number since.
constexpr int kMostThreads = 1024;
void parallel_for(int64_t n, const std::function<void(int64_t, int)>& task, int workers = kMostThreads);

}  // namespace dd
