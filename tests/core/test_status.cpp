// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <cstring>
#include <set>
#include <string>

#include "lecalib/core/status.hpp"

using lecalib::Status;

TEST_CASE("every status has a name of its own") {
  std::set<std::string> names;
  for (int value = 0; value < 256; ++value) {
    const std::string name = lecalib::to_string(static_cast<Status>(value));
    if (name != "unknown") CHECK(names.insert(name).second);
  }
  CHECK(names.size() == 17);
}

TEST_CASE("only failures are errors") {
  CHECK_FALSE(is_error(Status::ok));
  CHECK_FALSE(is_error(Status::in_progress));
  CHECK_FALSE(is_error(Status::need_more_data));
  CHECK(is_error(Status::invalid_argument));
  CHECK(is_error(Status::io_error));
}
