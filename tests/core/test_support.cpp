// SPDX-License-Identifier: MIT
// The test helpers themselves: an oracle that sees nothing proves nothing.
#include <doctest/doctest.h>

#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <initializer_list>
#include <memory>
#include <vector>

#include "lecalib/math/eigen.hpp"
#include "support/alloc_counter.hpp"
#include "support/guarded_arena.hpp"
#include "support/numeric_jacobian.hpp"

using lecalib::Vec2;
using lecalib::Vec3;
using lecalib::test::AllocScope;

TEST_CASE("support: the allocation counter sees new, malloc, calloc and realloc") {
  const AllocScope heap;
  CHECK(heap.allocations() == 0);
  const AllocScope with_new;
  const auto owned = std::make_unique<std::vector<int>>(100);
  const std::size_t counted_new = with_new.allocations();
  CHECK(counted_new == 2);
  const AllocScope with_malloc;
  void* volatile block = std::malloc(10);
  block = std::realloc(block, 10000);
  void* volatile zeroed = std::calloc(10, 10);
  const std::size_t counted_malloc = with_malloc.allocations();
  std::free(block);
  std::free(zeroed);
  CHECK(counted_malloc == 3);
}

TEST_CASE("support: the guarded arena sees a write beyond either end") {
  lecalib::test::GuardedArena memory(33);
  CHECK(memory.memory()[0] == std::byte{0xA5});
  CHECK(memory.intact());
  for (const std::ptrdiff_t beyond : {std::ptrdiff_t{-1}, std::ptrdiff_t{33}}) {
    std::byte* const place = memory.memory().data() + beyond;
    *place = std::byte{0};
    CHECK_FALSE(memory.intact());
    *place = std::byte{0xA5};
  }
}

TEST_CASE("support: the numeric Jacobian of a known function") {
  const auto f = [](const Vec3& v) { return Vec2(v.x() * v.y() * v.z(), std::sin(v.x()) + v.z() * v.z() * v.z()); };
  const Vec3 at(0.3, -2.0, 1.5);
  Eigen::Matrix<double, 2, 3> expected;
  expected << at.y() * at.z(), at.x() * at.z(), at.x() * at.y(), std::cos(at.x()), 0.0, 3.0 * at.z() * at.z();
  const auto jacobian = lecalib::test::numeric_jacobian<2, 3>(f, at);
  CHECK(lecalib::test::jacobian_error(jacobian, expected) < 1e-10);
}
