// What the whole process shares, and a forked child starts over with.
#pragma once
#include <mutex>

#if defined(__linux__)
#include <pthread.h>
#endif

namespace dd {

// The one T of this process. Never destroyed: threads and frames may outlive the module's statics. A child forked while
// another thread works would wait for that thread, which it does not have: it gets T::after_fork(of its parent).
template <class T>
class ForkSafe {
 public:
  static T& get() {
    static std::once_flag once;
    std::call_once(once, [] {
      slot() = new T();
#if defined(__linux__)
      pthread_atfork(nullptr, nullptr, [] { slot() = T::after_fork(*slot()); });
#endif
    });
    return *slot();
  }

 private:
  static T*& slot() {
    static T* shared = nullptr;
    return shared;
  }
};

}  // namespace dd
