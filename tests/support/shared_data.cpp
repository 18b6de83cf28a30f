// SPDX-License-Identifier: MIT
#include "support/shared_data.hpp"

#include <cstdlib>
#include <system_error>

namespace lecalib::test {

std::optional<std::filesystem::path> shared_data() {
  std::error_code ignored;
  const char* from_environment = std::getenv("LECALIB_SHARED_DATA");
  const std::filesystem::path folder =
      from_environment != nullptr ? std::filesystem::path(from_environment) : source_dir() / ".." / "shared" / "data";
  if (!std::filesystem::is_directory(folder, ignored)) return std::nullopt;
  return std::filesystem::canonical(folder, ignored);
}

std::filesystem::path source_dir() { return LECALIB_SOURCE_DIR; }

}  // namespace lecalib::test
