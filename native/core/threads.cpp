#include "threads.h"

#include <atomic>
#include <condition_variable>
#include <exception>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "after_fork.h"

#if defined(__linux__)
#include <sched.h>
#endif

namespace dd {
namespace {

constexpr int kSpins = 4000;  // about 20 microseconds: the gap between two stages of one render

class Pool {
 public:
  explicit Pool(int count) {
    threads_.reserve(size_t(count));
    try {
      for (int worker = 1; worker < count; worker++) threads_.emplace_back([this, worker] { serve(worker); });
    } catch (const std::exception&) {
      // The system gives no more: those that run do the work, and the same comes out.
    }
    while (ready_ != int(threads_.size())) std::this_thread::yield();
  }

  ~Pool() {
    {
      std::lock_guard<std::mutex> lock(mutex_);
      stopping_ = true;
    }
    wake_.notify_all();
    for (auto& thread : threads_) thread.join();
  }

  void run(int64_t n, const std::function<void(int64_t, int)>& task, int workers) {
    {
      std::lock_guard<std::mutex> lock(mutex_);
      task_ = &task;
      size_ = n;
      workers_ = workers;
      next_ = 0;
      round_++;
    }
    wake_.notify_all();
    work(0, task, n);
    {
      std::lock_guard<std::mutex> lock(mutex_);
      task_ = nullptr;  // who wakes up only now has nothing to do, and is not waited for
    }
    for (int spin = 0; busy_ != 0; spin++)
      if (spin > kSpins) std::this_thread::yield();
    if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
  }

 private:
  void work(int worker, const std::function<void(int64_t, int)>& task, int64_t n) {
    try {
      for (int64_t i; (i = next_.fetch_add(1, std::memory_order_relaxed)) < n;) task(i, worker);
    } catch (...) {
      next_ = n;
      std::lock_guard<std::mutex> lock(mutex_);
      if (!error_) error_ = std::current_exception();
    }
  }

  // A thread gets its own data when it first asks for them, and glibc ends the process where no memory is
  // left for that: exceptions and the allocator ask for them here, not where memory has ended.
  void begin() {
    try {
      throw std::make_unique<char[]>(64);
    } catch (const std::unique_ptr<char[]>&) {
    }
    ready_++;
  }

  void serve(int worker) {
    begin();
    for (uint64_t seen = 0;;) {
      for (int spin = 0; spin < kSpins && round_ == seen; spin++) {
      }
      const std::function<void(int64_t, int)>* task = nullptr;
      int64_t n = 0;
      {
        std::unique_lock<std::mutex> lock(mutex_);
        wake_.wait(lock, [&] { return stopping_ || round_ != seen; });
        if (stopping_) return;
        seen = round_;
        if (!task_ || worker >= workers_) continue;
        task = task_;
        n = size_;
        busy_++;
      }
      work(worker, *task, n);
      busy_--;
    }
  }

  std::vector<std::thread> threads_;
  std::mutex mutex_;
  std::condition_variable wake_;
  bool stopping_ = false;
  std::atomic<uint64_t> round_{0};
  std::atomic<int> busy_{0};
  std::atomic<int> ready_{0};  // threads that have begun
  std::atomic<int64_t> next_{0};
  int64_t size_ = 0;
  int workers_ = 0;
  std::exception_ptr error_;  // what the first task that failed threw
  const std::function<void(int64_t, int)>* task_ = nullptr;
};

int available_cores() {
#if defined(__linux__)
  cpu_set_t set;
  if (sched_getaffinity(0, sizeof(set), &set) == 0) return CPU_COUNT(&set);
#endif
  const unsigned count = std::thread::hardware_concurrency();
  return count ? int(count) : 1;
}

struct Shared {
  std::mutex mutex;  // one parallel_for at a time
  int count = available_cores();
  std::unique_ptr<Pool> pool;
  // A child has no worker threads: it starts over with a pool of its own.
  static Shared* after_fork(const Shared& parent) {
    auto* shared = new Shared();
    shared->count = parent.count;
    return shared;
  }
};

Shared& shared() { return ForkSafe<Shared>::get(); }

}  // namespace

int thread_count() { return shared().count; }

void set_thread_count(int count) {
  Shared& s = shared();
  std::lock_guard<std::mutex> lock(s.mutex);
  if (count == s.count) return;
  s.pool.reset();
  s.count = count;
}

void parallel_for(int64_t n, const std::function<void(int64_t, int)>& task, int workers) {
  Shared& s = shared();
  std::lock_guard<std::mutex> lock(s.mutex);
  if (s.count == 1 || n <= 1) {
    for (int64_t i = 0; i < n; i++) task(i, 0);
    return;
  }
  if (!s.pool) s.pool = std::make_unique<Pool>(s.count);
  s.pool->run(n, task, workers);
}

}  // namespace dd
