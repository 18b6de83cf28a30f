// SPDX-License-Identifier: MIT
#pragma once

#include <doctest/doctest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "lecalib/host/file_io.hpp"

namespace lecalib::test {

/// What a file holds that must be there.
inline nlohmann::json json_of(const std::string& path) {
  const auto text = host::read_text_file(path);
  REQUIRE(text.ok());
  return nlohmann::json::parse(text.value());
}

}  // namespace lecalib::test
