// SPDX-License-Identifier: MIT
/// Recordings that are too large for the repository. Tests that want them say so and pass when they are missing.
#pragma once

#include <filesystem>
#include <optional>

namespace lecalib::test {

/// The folder of shared recordings: $LECALIB_SHARED_DATA, or shared/data beside the source tree; nothing if there is
/// neither. A test without it says what it skips and returns:
///
///     const auto data = shared_data();
///     if (!data) { MESSAGE("skipped: no shared data"); return; }
std::optional<std::filesystem::path> shared_data();

/// The folder of this repository, for files that are committed beside the tests.
std::filesystem::path source_dir();

}  // namespace lecalib::test
