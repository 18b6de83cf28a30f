// SPDX-License-Identifier: MIT
/// How the host layer says what went wrong: one line for people, with the place it happened.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <variant>

#include "lecalib/core/status.hpp"

namespace lecalib::host {

/// One thing that went wrong with a file, a text or an option.
struct Error {
  std::string message;                     ///< one line without the place, e.g. "expected 7 fields, found 3"
  std::string file = {};                   ///< empty when no file is meant
  std::size_t line = 0;                    ///< 1-based; 0 when the place is not a line of text
  std::size_t column = 0;                  ///< 1-based, in bytes; 0 when the whole line is meant
  std::optional<std::uint64_t> byte = {};  ///< offset in a binary file
  Status status = Status::malformed_input;
};

/// "FILE:LINE:COLUMN: message" or "FILE: byte N: message", with the parts that are known.
std::string to_string(const Error& error);

/// A value, or why there is none.
template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : content_(std::move(value)) {}      // NOLINT(google-explicit-constructor)
  Result(Error error) : content_(std::move(error)) {}  // NOLINT(google-explicit-constructor)

  [[nodiscard]] bool ok() const { return content_.index() == 0; }
  [[nodiscard]] const T& value() const& { return std::get<0>(content_); }
  [[nodiscard]] T& value() & { return std::get<0>(content_); }
  [[nodiscard]] T&& value() && { return std::get<0>(std::move(content_)); }
  [[nodiscard]] const Error& error() const { return std::get<1>(content_); }

 private:
  std::variant<T, Error> content_;
};

/// For functions without a value: empty means success.
using MaybeError = std::optional<Error>;

}  // namespace lecalib::host
