// SPDX-License-Identifier: MIT
#include "lecalib/core/time.hpp"

#include <doctest/doctest.h>

#include <limits>

TEST_CASE("time: the distance of any two times is right, also where a signed difference overflows") {
  using lecalib::distance_us;
  constexpr std::int64_t kFirst = std::numeric_limits<std::int64_t>::min();
  constexpr std::int64_t kLast = std::numeric_limits<std::int64_t>::max();
  CHECK(distance_us(-3, 4) == 7);
  CHECK(distance_us(kLast, kLast) == 0);
  CHECK(distance_us(kFirst, 0) == std::uint64_t{1} << 63U);
  CHECK(distance_us(kFirst, kLast) == std::numeric_limits<std::uint64_t>::max());
}
