// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <cstdint>
#include <limits>

#include "lecalib/core/arena.hpp"
#include "support/alloc_counter.hpp"
#include "support/guarded_arena.hpp"

using lecalib::Arena;
using lecalib::ArenaMeter;
using lecalib::Span;
using lecalib::test::AllocScope;
using lecalib::test::GuardedArena;

namespace {

struct Wide {
  double value;
  char tail;
};

// Sizes and alignments that force padding between the fields and make the scratch of one stage larger than the other's.
struct Workspace {
  Span<char> tags;
  Span<Wide> kept;
  Span<std::uint16_t> scratch_a;
  Span<double> scratch_b;
};

template <class Carver>
constexpr bool carve(Carver& carver, std::size_t n, Workspace* out) {
  if (!carver.carve(n, &out->tags) || !carver.carve(n, &out->kept)) return false;
  const std::size_t mark = carver.mark();
  if (!carver.carve(3 * n, &out->scratch_a)) return false;
  carver.rewind(mark);
  return carver.carve(2 * n, &out->scratch_b);
}

constexpr std::size_t required_bytes(std::size_t n) {
  ArenaMeter meter;
  Workspace ignored;
  carve(meter, n, &ignored);
  return meter.peak();
}

template <class T>
bool is_aligned(const Span<T>& span) {
  return reinterpret_cast<std::uintptr_t>(span.data()) % alignof(T) == 0;
}

}  // namespace

TEST_CASE("arena: the meter and the arena agree to the byte") {
  static_assert(required_bytes(0) == 0);
  static_assert(required_bytes(1) == 8 + sizeof(Wide) + 2 * sizeof(double));
  for (std::size_t n = 0; n < 40; ++n) {
    GuardedArena memory(required_bytes(n));
    Workspace workspace;
    REQUIRE(carve(memory.arena(), n, &workspace));
    CHECK(memory.arena().peak() == required_bytes(n));
    CHECK(workspace.kept.size() == n);
    CHECK(workspace.scratch_b.size() == 2 * n);
  }
}

TEST_CASE("arena: one byte less than required is refused, not overrun") {
  for (std::size_t n = 1; n < 40; ++n) {
    GuardedArena memory(required_bytes(n) - 1);
    Workspace workspace;
    CHECK_FALSE(carve(memory.arena(), n, &workspace));
    CHECK(workspace.scratch_b.empty());
    CHECK(memory.arena().peak() <= memory.arena().capacity());
  }
}

TEST_CASE("arena: every span is aligned, inside of the memory and apart from the others") {
  GuardedArena memory(required_bytes(7));
  Workspace workspace;
  REQUIRE(carve(memory.arena(), 7, &workspace));
  CHECK(is_aligned(workspace.kept));
  CHECK(is_aligned(workspace.scratch_a));
  CHECK(is_aligned(workspace.scratch_b));
  for (char& tag : workspace.tags) tag = 'x';
  for (Wide& wide : workspace.kept) wide = {1.0, 'y'};
  for (double& number : workspace.scratch_b) number = 2.0;
  for (const char tag : workspace.tags) CHECK(tag == 'x');
  for (const Wide& wide : workspace.kept) CHECK(wide.value == 1.0);
}

TEST_CASE("arena: what is carved after a rewind shares the bytes") {
  GuardedArena memory(64);
  Arena& arena = memory.arena();
  const std::size_t mark = arena.mark();
  Span<std::uint32_t> first;
  Span<std::uint32_t> second;
  REQUIRE(arena.carve(16, &first));
  CHECK_FALSE(arena.carve(1, &second));
  arena.rewind(mark);
  REQUIRE(arena.carve(8, &second));
  CHECK(first.data() == second.data());
  CHECK(arena.mark() == 32);
  CHECK(arena.peak() == 64);
}

TEST_CASE("arena: a misaligned base is refused") {
  GuardedArena memory(256);
  for (std::size_t offset = 1; offset < lecalib::kArenaAlign; ++offset) {
    Arena arena(memory.memory().subspan(offset));
    Span<char> out;
    CHECK_FALSE(arena.carve(1, &out));
    CHECK(out.empty());
  }
}

TEST_CASE("arena: a count whose bytes would overflow is refused") {
  GuardedArena memory(64);
  Span<double> out;
  CHECK_FALSE(memory.arena().carve(std::numeric_limits<std::size_t>::max(), &out));
  CHECK_FALSE(memory.arena().carve(std::numeric_limits<std::size_t>::max() / sizeof(double) + 1, &out));
  CHECK(memory.arena().mark() == 0);
}

TEST_CASE("arena: a default-constructed one has no memory") {
  Arena arena;
  Span<char> out;
  CHECK_FALSE(arena.carve(1, &out));
  CHECK(arena.capacity() == 0);
}

TEST_CASE("arena: carving never touches the heap") {
  GuardedArena memory(required_bytes(20));
  Workspace workspace;
  const AllocScope heap;
  const bool carved = carve(memory.arena(), 20, &workspace);
  const std::size_t allocations = heap.allocations();
  CHECK(carved);
  CHECK(allocations == 0);
}
