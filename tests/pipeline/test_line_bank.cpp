// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <vector>

#include "lecalib/pipeline/line_bank.hpp"

using namespace lecalib;

namespace {

/// A bank in memory of its own; window i carries one line whose event count is i.
struct Fixture {
  Fixture(std::uint32_t windows, std::uint32_t lines) : bytes(1U << 16U) {
    Arena arena({bytes.data(), bytes.size()});
    REQUIRE(bank.carve(arena, windows, lines));
  }
  void add(std::uint32_t i) {
    EventLine line{};
    line.events = i;
    bank.add({i * 10, i * 10 + 10, {&line, 1}});
  }
  std::vector<std::byte> bytes;
  LineBank bank;
};

}  // namespace

TEST_CASE("a bank that is not full keeps every window") {
  Fixture f(8, 4);
  for (std::uint32_t i = 0; i < 8; ++i) f.add(i);
  REQUIRE(f.bank.windows().size() == 8);
  for (std::uint32_t i = 0; i < 8; ++i) CHECK(f.bank.windows()[i].lines[0].events == i);
}

TEST_CASE("a full bank keeps an even share of all windows offered") {
  for (std::uint32_t offered = 1; offered < 200; ++offered) {
    Fixture f(8, 4);
    for (std::uint32_t i = 0; i < offered; ++i) f.add(i);
    const auto windows = f.bank.windows();
    REQUIRE(windows.size() >= (offered < 8 ? offered : 4));
    REQUIRE(windows.size() <= 8);
    const std::uint32_t stride = windows.size() > 1 ? windows[1].lines[0].events : 1;
    for (std::uint32_t i = 0; i < windows.size(); ++i) {
      CHECK(windows[i].lines[0].events == i * stride);
      CHECK(windows[i].begin_us == std::int64_t{10} * i * stride);
    }
    CHECK(offered - windows[windows.size() - 1].lines[0].events <= stride);
    CHECK(f.bank.offered() == offered);
  }
}

TEST_CASE("lines beyond the capacity are counted") {
  Fixture f(2, 4);
  const std::vector<EventLine> lines(7);
  f.bank.add({0, 10, lines});
  CHECK(f.bank.windows()[0].lines.size() == 4);
  CHECK(f.bank.lines_dropped() == 3);
}

TEST_CASE("a cleared bank starts again") {
  Fixture f(2, 4);
  for (std::uint32_t i = 0; i < 9; ++i) f.add(i);
  f.bank.clear();
  f.add(5);
  REQUIRE(f.bank.windows().size() == 1);
  CHECK(f.bank.windows()[0].lines[0].events == 5);
}
