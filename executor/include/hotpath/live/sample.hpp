// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <utility>

namespace hotpath {

/// The owner of lent samples, to which they return. Called from any thread, never under the
/// executor's lock.
class SampleOwner {
 public:
  virtual void give_back(const void* data, std::uintptr_t token) noexcept = 0;
  /// Lends a lent sample once more: it will be returned twice.
  virtual void lend_again(std::uintptr_t token) noexcept = 0;

 protected:
  ~SampleOwner() = default;
};

/// One received message, lent by a transport until this handle is destroyed. Move-only; no allocation.
class Sample {
 public:
  Sample() = default;
  Sample(const void* data, SampleOwner& owner, std::uintptr_t token)
      : data_(data), owner_(&owner), token_(token) {}
  Sample(Sample&& other) noexcept
      : data_(std::exchange(other.data_, nullptr)), owner_(other.owner_), token_(other.token_) {}
  Sample& operator=(Sample&& other) noexcept {
    if (this != &other) {
      reset();
      data_ = std::exchange(other.data_, nullptr);
      owner_ = other.owner_;
      token_ = other.token_;
    }
    return *this;
  }
  ~Sample() { reset(); }

  void reset() noexcept {
    if (data_ != nullptr) owner_->give_back(std::exchange(data_, nullptr), token_);
  }
  explicit operator bool() const { return data_ != nullptr; }
  /// Returns another handle to the same message. This handle must hold one.
  [[nodiscard]] Sample share() const noexcept {
    owner_->lend_again(token_);
    return {data_, *owner_, token_};
  }
  template <class Message>
  [[nodiscard]] const Message& as() const {
    return *static_cast<const Message*>(data_);
  }

 private:
  const void* data_ = nullptr;
  SampleOwner* owner_ = nullptr;
  std::uintptr_t token_ = 0;
};

}  // namespace hotpath
