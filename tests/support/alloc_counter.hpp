// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>

namespace lecalib::test {

/// Counts the heap allocations (malloc and its relatives, operator new) of this thread since its construction:
///
///     const AllocScope heap;
///     const Status status = detect_lines(...);
///     CHECK(heap.allocations() == 0);
///
/// Read the count before doctest's macros run: they allocate.
class AllocScope {
 public:
  AllocScope() noexcept;
  [[nodiscard]] std::size_t allocations() const noexcept;

 private:
  std::size_t at_begin_;
};

}  // namespace lecalib::test
