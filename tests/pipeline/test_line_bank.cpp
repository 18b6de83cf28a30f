// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <algorithm>
#include <vector>

#include "lecalib/core/rng.hpp"
#include "lecalib/pipeline/line_bank.hpp"

using namespace lecalib;

namespace {

/// A bank in memory of its own; window i carries one line whose event count is i, with an edge.
struct Fixture {
  Fixture(std::uint32_t windows, std::uint32_t lines) : bytes(1U << 16U) {
    Arena arena({bytes.data(), bytes.size()});
    REQUIRE(bank.carve(arena, windows, lines));
  }
  void add(std::uint32_t i, float sigma_px = 0.1F) {
    EventLine line{};
    line.events = i;
    line.edge.crossings = 100;
    for (float& sigma : line.edge.sigma_px) sigma = sigma_px;
    bank.add({i * 10, i * 10 + 10, {&line, 1}}, LineBank::information_of({&line, 1}));
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

TEST_CASE(
    "line bank: of windows that tell alike a full bank keeps the first, the newest, and an even share of the rest") {
  for (std::uint32_t offered = 1; offered < 200; ++offered) {
    CAPTURE(offered);
    Fixture f(8, 4);
    for (std::uint32_t i = 0; i < offered; ++i) f.add(i);
    const auto windows = f.bank.windows();
    REQUIRE(windows.size() == std::min<std::size_t>(offered, 8));
    CHECK(windows[0].lines[0].events == 0);
    CHECK(windows[windows.size() - 1].lines[0].events == offered - 1);
    for (std::uint32_t i = 1; i < windows.size(); ++i) {
      const std::uint32_t step = windows[i].lines[0].events - windows[i - 1].lines[0].events;
      CHECK(step >= 1);
      CHECK(8 * step <= 3 * offered + 8);
      CHECK(windows[i].begin_us == std::int64_t{10} * windows[i].lines[0].events);
    }
    CHECK(f.bank.offered() == offered);
  }
}

TEST_CASE("line bank: banks that are told the same information keep the same windows") {
  Fixture left(8, 4);
  Fixture right(8, 4);
  Rng rng(3);
  for (std::uint32_t i = 0; i < 100; ++i) {
    const auto information = static_cast<float>(rng.uniform(1.0, 1000.0));
    EventLine lines[2] = {};
    const std::int64_t begin_us = 10 * std::int64_t{i};
    left.bank.add({begin_us, begin_us + 10, {lines, 2}}, information);
    right.bank.add({begin_us, begin_us + 10, {lines, i % 3}}, information);
    REQUIRE(left.bank.windows().size() == right.bank.windows().size());
    for (std::size_t w = 0; w < left.bank.windows().size(); ++w) {
      CHECK(left.bank.windows()[w].begin_us == right.bank.windows()[w].begin_us);
    }
  }
}

TEST_CASE("line bank: a full bank keeps what tells most") {
  Fixture f(8, 4);
  for (std::uint32_t i = 0; i < 80; ++i) f.add(i, i % 10 == 5 ? 0.05F : 0.5F);
  std::size_t telling = 0;
  for (const LineWindow& window : f.bank.windows()) telling += window.lines[0].events % 10 == 5 ? 1 : 0;
  CHECK(telling >= 6);
}

TEST_CASE("lines beyond the capacity are counted") {
  Fixture f(2, 4);
  const std::vector<EventLine> lines(7);
  f.bank.add({0, 10, lines}, 1);
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
