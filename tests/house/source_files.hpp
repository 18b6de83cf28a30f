// SPDX-License-Identifier: MIT
/// The repository's own source text, for tests of its rules.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace lecalib::test {

struct SourceFile {
  std::filesystem::path path;      ///< relative to the repository, e.g. lecalib/core/span.hpp
  std::vector<std::string> lines;  ///< as they stand
  std::vector<std::string> code;   ///< the same lines with comments and the contents of string literals blanked

  /// The room of a library file ("core" for lecalib/core/span.hpp), else empty.
  [[nodiscard]] std::string room() const;
};

/// An #include line, without its brackets or quotes.
struct Include {
  std::string target;
  bool quoted;
};

/// Every .hpp and .cpp file below `folder` (relative to the repository), in order of their paths.
std::vector<SourceFile> source_files(const std::filesystem::path& folder);

/// Splits source text into lines and blanks what is not code.
SourceFile parse_source(const std::filesystem::path& path, const std::string& text);

std::vector<Include> includes_of(const SourceFile& file);

}  // namespace lecalib::test
