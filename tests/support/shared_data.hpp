// SPDX-License-Identifier: MIT
/// Recordings that are too large for the repository. Tests that want them say so and pass when they are missing.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <optional>
#include <system_error>

namespace lecalib::test {

/// The folder of shared recordings: $LECALIB_SHARED_DATA, or shared/data beside the source tree; nothing if there is
/// neither. A test without it says what it skips and returns:
///
///     const auto data = shared_data();
///     if (!data) { MESSAGE("skipped: no shared data"); return; }
inline std::optional<std::filesystem::path> shared_data() {
  std::error_code ignored;
  const char* from_environment = std::getenv("LECALIB_SHARED_DATA");
  const std::filesystem::path folder = from_environment != nullptr
                                           ? std::filesystem::path(from_environment)
                                           : std::filesystem::path(LECALIB_SOURCE_DIR) / ".." / "shared" / "data";
  if (!std::filesystem::is_directory(folder, ignored)) return std::nullopt;
  return std::filesystem::canonical(folder, ignored);
}

/// The folder of this repository, for files that are committed beside the tests.
inline std::filesystem::path source_dir() { return LECALIB_SOURCE_DIR; }

}  // namespace lecalib::test
