#include "threads.h"

#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#if defined(__linux__)
#include <pthread.h>
#include <sched.h>
#endif

namespace dd {
namespace {

constexpr int kSpins = 4000;  // about 20 microseconds: the gap between two stages of one render

class Pool {
 public:
  explicit Pool(int count) : count_(count) {
    for (int worker = 1; worker < count; worker++) threads_.emplace_back([this, worker] { serve(worker); });
  }

  ~Pool() {
    {
      std::lock_guard<std::mutex> lock(mutex_);
      stopping_ = true;
    }
    wake_.notify_all();
    for (auto& thread : threads_) thread.join();
  }

  int count() const { return count_; }

  void run(int64_t n, const std::function<void(int64_t, int)>& task) {
    {
      std::lock_guard<std::mutex> lock(mutex_);
      task_ = &task;
      size_ = n;
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
  }

 private:
  void work(int worker, const std::function<void(int64_t, int)>& task, int64_t n) {
    for (int64_t i; (i = next_.fetch_add(1, std::memory_order_relaxed)) < n;) task(i, worker);
  }

  void serve(int worker) {
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
        if (!task_) continue;
        task = task_;
        n = size_;
        busy_++;
      }
      work(worker, *task, n);
      busy_--;
    }
  }

  const int count_;
  std::vector<std::thread> threads_;
  std::mutex mutex_;
  std::condition_variable wake_;
  bool stopping_ = false;
  std::atomic<uint64_t> round_{0};
  std::atomic<int> busy_{0};
  std::atomic<int64_t> next_{0};
  int64_t size_ = 0;
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
};

Shared*& shared_slot() {
  static Shared* slot = nullptr;
  return slot;
}

// Never destroyed: joining threads while the interpreter unloads the module may hang.
Shared& shared() {
  static std::once_flag once;
  std::call_once(once, [] {
    shared_slot() = new Shared();
#if defined(__linux__)
    // A forked child has no worker threads: it starts over with a pool of its own.
    pthread_atfork(nullptr, nullptr, [] {
      const int count = shared_slot()->count;
      shared_slot() = new Shared();
      shared_slot()->count = count;
    });
#endif
  });
  return *shared_slot();
}

}  // namespace

int thread_count() { return shared().count; }

void set_thread_count(int count) {
  Shared& s = shared();
  std::lock_guard<std::mutex> lock(s.mutex);
  if (count == s.count) return;
  s.pool.reset();
  s.count = count;
}

void parallel_for(int64_t n, const std::function<void(int64_t, int)>& task) {
  Shared& s = shared();
  std::lock_guard<std::mutex> lock(s.mutex);
  if (s.count == 1 || n <= 1) {
    for (int64_t i = 0; i < n; i++) task(i, 0);
    return;
  }
  if (!s.pool) s.pool = std::make_unique<Pool>(s.count);
  s.pool->run(n, task);
}

}  // namespace dd
