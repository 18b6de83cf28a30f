// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include "lecalib/core/fixed_vector.hpp"

using lecalib::FixedVector;
using lecalib::Span;

TEST_CASE("fixed vector: takes exactly its storage and counts the rest") {
  int storage[3] = {};
  FixedVector<int> values{Span<int>(storage)};
  CHECK(values.empty());
  CHECK(values.capacity() == 3);
  for (int i = 0; i < 3; ++i) CHECK(values.try_push(10 + i));
  CHECK_FALSE(values.try_push(99));
  CHECK_FALSE(values.try_push(99));
  CHECK(values.size() == 3);
  CHECK(values.dropped() == 2);
  CHECK(values.back() == 12);
  CHECK(storage[0] == 10);
}

TEST_CASE("fixed vector: pop makes room, clear forgets the drops too") {
  int storage[1] = {};
  FixedVector<int> values{Span<int>(storage)};
  CHECK(values.try_push(1));
  CHECK_FALSE(values.try_push(2));
  values.pop_back();
  CHECK(values.empty());
  CHECK(values.dropped() == 1);
  CHECK(values.try_push(3));
  CHECK(values[0] == 3);
  values.clear();
  CHECK(values.empty());
  CHECK(values.dropped() == 0);
}

TEST_CASE("fixed vector: iterates and views what was pushed, not what there is room for") {
  int storage[8] = {};
  FixedVector<int> values{Span<int>(storage)};
  for (int i = 1; i <= 4; ++i) CHECK(values.try_push(i));
  int sum = 0;
  for (const int value : values) sum += value;
  CHECK(sum == 10);
  CHECK(values.view().size() == 4);
  CHECK(values.view().data() == storage);
}

TEST_CASE("fixed vector: without storage it is always full") {
  FixedVector<int> values;
  CHECK_FALSE(values.try_push(1));
  CHECK(values.size() == 0);
  CHECK(values.view().empty());
}
