// SPDX-License-Identifier: MIT
/// The only reader of build-wide LECALIB_* macros.
#pragma once

// Vectors of two doubles, bits, atomic words and what is inlined are told to the compiler as GCC and Clang have it, and
// so is that products and sums are not contracted, without which bits would differ.
#ifndef __GNUC__
#error "lecalib needs GCC or Clang"
#endif

namespace lecalib {

/// Called when a programmer's error is found (never because of input data). Must not return.
using AssertHandler = void (*)(const char* expression, const char* file, int line);

/// Replaces the assert handler; nullptr restores the default, which stops by a trap instruction. Not thread safe.
void set_assert_handler(AssertHandler handler) noexcept;

namespace detail {
[[noreturn]] void assert_failed(const char* expression, const char* file, int line) noexcept;
}

}  // namespace lecalib

/// Checks for programmer's errors. On in debug builds, or with LECALIB_CHECK=1; input can never reach one.
#ifndef LECALIB_CHECK
#ifdef NDEBUG
#define LECALIB_CHECK 0
#else
#define LECALIB_CHECK 1
#endif
#endif

#if LECALIB_CHECK
#define LECALIB_ASSERT(expression) \
  ((expression) ? static_cast<void>(0) : ::lecalib::detail::assert_failed(#expression, __FILE__, __LINE__))
#else
#define LECALIB_ASSERT(expression) static_cast<void>(sizeof((expression) ? 1 : 0))
#endif
