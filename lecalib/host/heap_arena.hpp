// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <memory>

#include "lecalib/core/arena.hpp"

namespace lecalib::host {

/// A block of heap memory to give to a calibrator on a machine that has a heap.
class HeapArena {
 public:
  explicit HeapArena(std::size_t bytes);
  [[nodiscard]] Span<std::byte> memory() const { return {block_.get(), bytes_}; }

 private:
  std::unique_ptr<std::byte[]> block_;
  std::size_t bytes_;
};

}  // namespace lecalib::host
