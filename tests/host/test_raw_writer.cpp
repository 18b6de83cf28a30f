// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <vector>

#include "lecalib/host/raw_writer.hpp"

using lecalib::Event;
using lecalib::host::encode_evt3;

namespace {

/// The 16-bit words after the header.
std::vector<unsigned> words_of(const std::string& file) {
  constexpr std::string_view kEnd = "% end\n";
  const std::size_t first = file.find(kEnd) + kEnd.size();
  std::vector<unsigned> words;
  for (std::size_t i = first; i + 1 < file.size(); i += 2) {
    words.push_back(static_cast<unsigned char>(file[i]) | static_cast<unsigned>(static_cast<unsigned char>(file[i + 1]))
                                                              << 8U);
  }
  return words;
}

}  // namespace

TEST_CASE("encode_evt3: the header tells format and size") {
  const auto file = encode_evt3({}, 346, 260);
  REQUIRE(file.ok());
  CHECK(file.value().find("% evt 3.0\n") != std::string::npos);
  CHECK(file.value().find("% format EVT3;height=260;width=346\n") != std::string::npos);
  CHECK(words_of(file.value()).empty());
}

TEST_CASE("encode_evt3: one word per change of time, row and column") {
  const std::vector<Event> events = {{5, 7, 3, 1}, {5, 9, 3, 0}, {6, 9, 4, 1}, {4097, 9, 4, 1}};
  const auto file = encode_evt3(events, 10, 10);
  REQUIRE(file.ok());
  CHECK(words_of(file.value()) == std::vector<unsigned>{0x8000, 0x6005, 0x0003, 0x2807, 0x2009,  //
                                                        0x6006, 0x0004, 0x2809, 0x8001, 0x6001, 0x2809});
}

TEST_CASE("encode_evt3: three events or more within twelve columns become a vector") {
  const std::vector<Event> events = {{0, 10, 0, 1}, {0, 12, 0, 1}, {0, 21, 0, 1}, {0, 22, 0, 1}};
  const auto file = encode_evt3(events, 30, 1);
  REQUIRE(file.ok());
  CHECK(words_of(file.value()) == std::vector<unsigned>{0x8000, 0x6000, 0x0000, 0x380A, 0x4805, 0x2816});
}

TEST_CASE("encode_evt3: no gap hides a roll-over of the 24-bit time") {
  constexpr std::int64_t kRollOver = std::int64_t{1} << 24;
  const std::vector<Event> events = {{kRollOver - 1, 0, 0, 1}, {3 * kRollOver, 0, 0, 1}};
  const auto file = encode_evt3(events, 1, 1);
  REQUIRE(file.ok());
  const std::vector<unsigned> words = words_of(file.value());
  unsigned high_words = 0;
  unsigned wraps = 0;
  unsigned last = 0;
  for (const unsigned word : words) {
    if (word >> 12U != 8) continue;
    ++high_words;
    if ((word & 0xFFFU) < last) ++wraps;
    last = word & 0xFFFU;
  }
  CHECK(high_words == 1 + 2 * 4096 + 1);
  CHECK(wraps == 3);
}

TEST_CASE("encode_evt3: what cannot be written is an error") {
  const Event inside{10, 1, 1, 1};
  CHECK_FALSE(encode_evt3({}, 0, 10).ok());
  CHECK_FALSE(encode_evt3({}, 10, 2049).ok());
  CHECK(encode_evt3({}, 2048, 2048).ok());
  CHECK_FALSE(encode_evt3(std::vector<Event>{{10, 2, 1, 1}}, 2, 2).ok());
  CHECK_FALSE(encode_evt3(std::vector<Event>{{10, 1, 2, 1}}, 2, 2).ok());
  CHECK_FALSE(encode_evt3(std::vector<Event>{{-1, 1, 1, 1}}, 2, 2).ok());
  const auto disorder = encode_evt3(std::vector<Event>{inside, {9, 1, 1, 1}}, 2, 2);
  REQUIRE_FALSE(disorder.ok());
  CHECK(disorder.error().message.find("event 1 ") != std::string::npos);
}
