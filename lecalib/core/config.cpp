// SPDX-License-Identifier: MIT
#include "lecalib/core/config.hpp"

namespace lecalib {
namespace {
AssertHandler g_assert_handler = nullptr;
}

void set_assert_handler(AssertHandler handler) noexcept { g_assert_handler = handler; }

void detail::assert_failed(const char* expression, const char* file, int line) noexcept {
  if (g_assert_handler != nullptr) g_assert_handler(expression, file, line);
  __builtin_trap();
}

}  // namespace lecalib
