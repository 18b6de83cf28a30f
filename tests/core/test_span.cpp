// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <array>
#include <limits>
#include <type_traits>
#include <vector>

#include "lecalib/core/span.hpp"

using lecalib::Span;

static_assert(std::is_convertible_v<Span<int>, Span<const int>>);
static_assert(std::is_convertible_v<std::vector<int>&, Span<int>>);
static_assert(std::is_convertible_v<const std::vector<int>&, Span<const int>>);
static_assert(!std::is_convertible_v<const std::vector<int>&, Span<int>>, "const is kept");
static_assert(!std::is_convertible_v<std::vector<double>&, Span<int>>, "types are kept");
static_assert(std::is_trivially_copyable_v<Span<int>>);

TEST_CASE("span: views arrays, containers and pointers without copying") {
  int array[3] = {1, 2, 3};
  std::array<int, 3> standard_array = {4, 5, 6};
  std::vector<int> vector = {7, 8};
  CHECK(Span<int>(array).data() == array);
  CHECK(Span<int>(standard_array).data() == standard_array.data());
  CHECK(Span<int>(vector).size() == 2);
  CHECK(Span<const int>(vector)[1] == 8);
  Span<int>(array).data()[0] = 9;
  CHECK(array[0] == 9);
}

TEST_CASE("span: subspans are clamped to what is there") {
  int array[5] = {0, 1, 2, 3, 4};
  const Span<int> span(array);
  CHECK(span.subspan(1, 2).data() == array + 1);
  CHECK(span.subspan(1, 2).size() == 2);
  CHECK(span.subspan(3, 9).size() == 2);
  CHECK(span.subspan(5).empty());
  CHECK(span.subspan(99, 1).empty());
  CHECK(span.subspan(2, std::numeric_limits<std::size_t>::max()).size() == 3);
  CHECK(span.first(0).empty());
  CHECK(span.first(99).size() == 5);
}

TEST_CASE("span: a default-constructed one is empty and iterates over nothing") {
  const Span<int> span;
  CHECK(span.empty());
  CHECK(span.data() == nullptr);
  CHECK(span.subspan(0, 3).empty());
  for (const int value : span) FAIL("visited " << value);
}
