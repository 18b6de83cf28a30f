// SPDX-License-Identifier: MIT
#include "support/json_file.hpp"

#include <doctest/doctest.h>

#include "lecalib/host/file_io.hpp"

namespace lecalib::test {

nlohmann::json json_in(const std::string& text) { return nlohmann::json::parse(text); }

nlohmann::json json_of(const std::string& path) {
  const auto text = host::read_text_file(path);
  REQUIRE(text.ok());
  return json_in(text.value());
}

}  // namespace lecalib::test
