// SPDX-License-Identifier: MIT
/// What lecalib's JSON is checked with. Read in one place: every file that parsed by itself would have the parser
/// compiled anew.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace lecalib::test {

/// What a text says; throws where it is no JSON.
nlohmann::json json_in(const std::string& text);
/// What a file holds that must be there.
nlohmann::json json_of(const std::string& path);

}  // namespace lecalib::test
