// Memory that only grows and is never initialised: reused from one render to the next.
#pragma once
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <new>
#include <utility>
#include <vector>

#if defined(__linux__)
#include <sys/mman.h>
#endif
#if defined(__SANITIZE_ADDRESS__)
#include <sanitizer/asan_interface.h>
#endif

namespace dd {

template <class T>
class Buffer {
 public:
  Buffer() = default;
  Buffer(const Buffer&) = delete;
  Buffer& operator=(const Buffer&) = delete;
  ~Buffer() { std::free(data_); }

  // Room for `count`; what was there is lost when it grows.
  T* resize(size_t count) {
    if (count > capacity_) {
      const size_t wanted = count + count / 4 + 64;
      std::free(data_);
      data_ = nullptr;  // the allocation may throw
      capacity_ = 0;
      data_ = static_cast<T*>(allocate(wanted * sizeof(T)));
      capacity_ = wanted;
    }
    return fenced(count);
  }
  // Room for `count`, the first `kept` values staying.
  T* grow(size_t kept, size_t count) {
    if (count <= capacity_) return fenced(count);
    Buffer larger;
    larger.resize(count);
    std::memcpy(larger.data_, data_, kept * sizeof(T));
    std::swap(data_, larger.data_);
    std::swap(capacity_, larger.capacity_);
    return data_;
  }
  T* data() { return data_; }
  const T* data() const { return data_; }
  T& operator[](size_t i) { return data_[i]; }
  const T& operator[](size_t i) const { return data_[i]; }

 private:
  // AddressSanitizer reports what reads or writes beyond `count`, where an earlier, larger use left its values.
  T* fenced([[maybe_unused]] size_t count) {
#if defined(__SANITIZE_ADDRESS__)
    ASAN_UNPOISON_MEMORY_REGION(data_, count * sizeof(T));
    ASAN_POISON_MEMORY_REGION(data_ + count, (capacity_ - count) * sizeof(T));
#endif
    return data_;
  }
  // Large memory is wanted in large pages: most of it is read in no order, and every small page would be looked up.
  static void* allocate(size_t bytes) {
    constexpr size_t kPage = size_t(1) << 21;
    const size_t align = bytes < kPage ? 64 : kPage;
    void* data = std::aligned_alloc(align, (bytes + align - 1) / align * align);
    if (!data) throw std::bad_alloc();
#if defined(__linux__)
    if (align == kPage) madvise(data, bytes, MADV_HUGEPAGE);
#endif
    return data;
  }

  T* data_ = nullptr;
  size_t capacity_ = 0;
};

// Floats that begin with a line of the cache: a vector register may be as long as one, and loads of two lines take twice
// as long.
template <class T>
struct LineAllocator {
  using value_type = T;
  static constexpr std::align_val_t kLine{64};
  LineAllocator() = default;
  template <class Other>
  LineAllocator(const LineAllocator<Other>&) {}
  T* allocate(size_t count) { return static_cast<T*>(::operator new(count * sizeof(T), kLine)); }
  void deallocate(T* data, size_t) { ::operator delete(data, kLine); }
  friend bool operator==(const LineAllocator&, const LineAllocator&) { return true; }
  friend bool operator!=(const LineAllocator&, const LineAllocator&) { return false; }
};
using Floats = std::vector<float, LineAllocator<float>>;

}  // namespace dd
