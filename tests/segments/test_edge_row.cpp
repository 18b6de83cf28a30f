// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <cstdlib>
#include <utility>
#include <vector>

#include "lecalib/core/rng.hpp"
#include "lecalib/segments/edge_row.hpp"

using namespace lecalib;

namespace {

constexpr int kLengthPx = 203;

using Pieces = std::vector<std::pair<int, int>>;

/// Events of an edge that fires everywhere but in a gap, which moves along it during the window.
std::vector<LineEvent> edge_with_gap(double per_px, double gap_from, double gap_to, double motion_px,
                                     std::uint64_t seed) {
  Rng rng(seed);
  std::vector<LineEvent> events;
  for (int i = 0; i < static_cast<int>(per_px * kLengthPx); ++i) {
    const double s = rng.uniform(0, kLengthPx);
    const double tau = rng.uniform(-1, 1);
    const double at_mid_window = s - 0.5 * motion_px * tau;
    if (at_mid_window > gap_from && at_mid_window < gap_to) continue;
    events.push_back({0, static_cast<float>(s), 0, static_cast<float>(tau), static_cast<float>(rng.uniform(-1, 1))});
  }
  return events;
}

struct Row {
  std::vector<std::uint16_t> memory = std::vector<std::uint16_t>(1024, 0xFFFF);
  EdgeRow row;

  explicit Row(const std::vector<LineEvent>& events) : row(line(), {memory.data(), memory.size()}) {
    for (const LineEvent& event : events) row.add(event);
  }
  static MovingLine line() {
    MovingLine line;
    line.high[0] = line.high[1] = kLengthPx - 0.5F;
    line.thickness_px = 0.5F;
    return line;
  }
};

Pieces pieces_of(const EdgeRow& row, const GapMotion& gaps) {
  Pieces pieces;
  row.for_each_piece(gaps, [&](int first, int end) {
    if (end > first) pieces.emplace_back(first, end);
  });
  return pieces;
}

/// The same by brute force: each pixel of mid window is looked up in all eighths of the window, one after the other.
Pieces brute_force(const std::vector<LineEvent>& events, const GapMotion& gaps) {
  std::vector<std::vector<bool>> fired(8, std::vector<bool>(kLengthPx));
  for (const LineEvent& event : events) {
    if (event.along_px >= kLengthPx - 0.5F) continue;
    const int slice = static_cast<int>((event.tau + 1) * 4);
    fired[static_cast<std::size_t>(slice < 8 ? slice : 7)][static_cast<std::size_t>(event.along_px)] = true;
  }
  const auto fires = [&](int pixel) {
    for (int slice = 0; slice < 8; ++slice) {
      const int at = pixel + gaps.motion_px * (2 * slice - 7) / 16;
      if (at < 0 || at >= kLengthPx) continue;
      if (fired[static_cast<std::size_t>(slice)][static_cast<std::size_t>(at)]) return true;
    }
    return false;
  };
  Pieces pieces;
  int first = 0;
  for (int i = 0; i < kLengthPx;) {
    int end = i;
    while (end < kLengthPx && !fires(end)) ++end;
    if (end - i >= gaps.least_px) {
      if (i > first) pieces.emplace_back(first, i);
      first = end;
    }
    i = end + 1;
  }
  if (kLengthPx > first) pieces.emplace_back(first, kLengthPx);
  return pieces;
}

}  // namespace

TEST_CASE("edge row: pieces are those of a brute-force search, for every motion and length of gap") {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const double per_px = 0.4 * static_cast<double>(seed);
    const std::vector<LineEvent> events = edge_with_gap(per_px, 90, 110, 6, seed);
    const Row row(events);
    REQUIRE(row.row.size() == kLengthPx);
    for (int motion = -12; motion <= 12; ++motion) {
      for (int least = 1; least <= 24; ++least) {
        CHECK(pieces_of(row.row, {least, motion}) == brute_force(events, {least, motion}));
      }
    }
  }
}

TEST_CASE("edge row: a gap is found with its motion, and an edge that fires everywhere has none") {
  for (const double motion : {-10.0, -4.0, 0.0, 6.0, 12.0}) {
    const Row row(edge_with_gap(6, 90, 104, motion, 11));
    const GapMotion gaps = row.row.find_gaps({});
    REQUIRE(gaps.least_px > 0);
    CHECK(std::abs(gaps.motion_px - motion) <= 4);
    const Pieces pieces = pieces_of(row.row, gaps);
    REQUIRE(pieces.size() == 2);
    CHECK(std::abs(pieces[0].second - 90) <= 3);
    CHECK(std::abs(pieces[1].first - 104) <= 3);
  }
  int found = 0;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    const double per_px = 0.5 + 0.05 * static_cast<double>(seed);
    found += Row(edge_with_gap(per_px, 0, 0, 0, seed)).row.find_gaps({}).least_px > 0 ? 1 : 0;
  }
  CHECK(found <= 4);  // by chance in one of e^5 = 148 lines
}

TEST_CASE("edge row: what is beyond the band or the ends leaves no trace, and memory bounds the row") {
  const Row row({{0, 50, 0, 0, 1.3F}, {0, -0.5F, 0, 0, 0}, {0, 203, 0, 0, 0}});
  CHECK(pieces_of(row.row, {1, 0}).empty());
  std::vector<std::uint16_t> memory(8 * 4);
  EdgeRow cut(Row::line(), {memory.data(), memory.size()});
  CHECK(cut.size() == 32);
  cut.add({0, 202, 0, 1, 0});  // counts in the last pixel that there is
  CHECK(pieces_of(cut, {1, 0}) == Pieces{{31, 32}});
  std::vector<std::uint16_t> least(24);
  EdgeRow word(Row::line(), {least.data(), least.size()});
  CHECK(word.size() == 16);
  word.add({0, 202, 0, -1, 0});
  CHECK(pieces_of(word, {1, 0}) == Pieces{{15, 16}});
}
