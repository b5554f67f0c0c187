// Memory for arrays of hundreds of megabytes.
#pragma once

#include <cstddef>
#include <span>
#include <type_traits>
#include <utility>

namespace nacre {

/// An array of plain values that are not set to anything, in large pages where the system has them: what is
/// written once, in parallel, spends as long on faults of small pages as on the writing. Throws
/// std::bad_alloc.
template <class T>
class LargeArray {
  static_assert(std::is_trivially_copyable_v<T> && std::is_trivially_destructible_v<T>);

 public:
  LargeArray() = default;
  explicit LargeArray(std::size_t size);
  ~LargeArray();
  LargeArray(const LargeArray&) = delete;
  LargeArray& operator=(const LargeArray&) = delete;
  LargeArray(LargeArray&& other) noexcept : data_(other.data_), size_(other.size_) { other.release(); }
  LargeArray& operator=(LargeArray&& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    return *this;
  }

  std::size_t size() const noexcept { return size_; }
  bool empty() const noexcept { return size_ == 0; }
  T* data() noexcept { return data_; }
  const T* data() const noexcept { return data_; }
  T& operator[](std::size_t i) noexcept { return data_[i]; }
  const T& operator[](std::size_t i) const noexcept { return data_[i]; }
  operator std::span<const T>() const noexcept { return {data_, size_}; }

 private:
  void release() noexcept { data_ = nullptr, size_ = 0; }

  T* data_ = nullptr;
  std::size_t size_ = 0;
};

/// Bytes that `free_large` takes back; at least as aligned as any type.
void* allocate_large(std::size_t bytes);
void free_large(void* memory) noexcept;

template <class T>
LargeArray<T>::LargeArray(std::size_t size)
    : data_(static_cast<T*>(allocate_large(size * sizeof(T)))), size_(size) {}
template <class T>
LargeArray<T>::~LargeArray() {
  free_large(data_);
}

}  // namespace nacre
