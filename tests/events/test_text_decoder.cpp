// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <limits>
#include <string>

#include "lecalib/events/text_decoder.hpp"
#include "support/alloc_counter.hpp"
#include "support/decode_pieces.hpp"

namespace lecalib::test {
namespace {

Decoded decode_text(const std::string& text, SensorSize size = {}) {
  return decode_whole(TextDecoder(size), to_bytes(text));
}

std::int64_t time_of(const std::string& field) {
  const Decoded decoded = decode_text(field + " 1 2 0\n");
  CAPTURE(field);
  CAPTURE(decoded.expected);
  REQUIRE(decoded.events.size() == 1);
  return decoded.events[0].t_us;
}

TEST_CASE("text: seconds, x, y, polarity with blanks") {
  const Decoded decoded = decode_text("0.003811000 96 133 0\n13.595874999001 345 259 1\n");
  CHECK(decoded.status == Status::ok);
  CHECK(decoded.events == std::vector<Event>{{3811, 96, 133, 0}, {13'595'875, 345, 259, 1}});
}

TEST_CASE("text: microseconds with commas under a title") {
  const Decoded decoded = decode_text("t_us,x,y,p\r\n1744227144732712,219,244,0\r\n1744227144732713, 249,\t254 ,1\r\n");
  CHECK(decoded.status == Status::ok);
  CHECK(decoded.events ==
        std::vector<Event>{{1'744'227'144'732'712, 219, 244, 0}, {1'744'227'144'732'713, 249, 254, 1}});
}

TEST_CASE("text: microseconds with blanks, comments, empty lines, no last line end") {
  const Decoded decoded = decode_text("# one\n\n  \n12 1 2 -1\n#two\n13\t3 4 +1");
  CHECK(decoded.status == Status::ok);
  CHECK(decoded.events == std::vector<Event>{{12, 1, 2, 0}, {13, 3, 4, 1}});
}

TEST_CASE("text: seconds are rounded to microseconds exactly") {
  CHECK(time_of("0.0000004") == 0);
  CHECK(time_of("0.0000005") == 1);
  CHECK(time_of("0.00000049999999999999999999") == 0);
  CHECK(time_of("-0.0000015") == -2);
  CHECK(time_of("2.09714") == 2'097'140);
  CHECK(time_of("13.595874999001") == 13'595'875);
  CHECK(time_of("0.9999999") == 1'000'000);
  CHECK(time_of("5.") == 5'000'000);
  CHECK(time_of(".5") == 500'000);
  CHECK(time_of("+7") == 7);
  CHECK(time_of("1744227144.732712") == 1'744'227'144'732'712);
  CHECK(time_of("9223372036854.775807") == std::numeric_limits<std::int64_t>::max());
  CHECK(time_of("-9223372036854775807") == -std::numeric_limits<std::int64_t>::max());
}

TEST_CASE("text: the first row's time sets the unit of all") {
  CHECK(decode_text("2.5 1 1 0\n3 1 1 0\n").events[1].t_us == 3'000'000);
  CHECK(decode_text("0 1 1 0\n0.5 1 1 0\n").events[1].t_us == 500'000);
  const Decoded mixed = decode_text("7 1 1 0\n0.5 1 1 0\n");
  CHECK(mixed.status == Status::malformed_input);
  CHECK(mixed.events.size() == 1);
  CHECK(mixed.expected == "a time in microseconds, as in rows before");
}

TEST_CASE("text: a first row of two integers is the sensor's size") {
  TextDecoder decoder;
  const Bytes bytes = to_bytes("240 180\n0.1 239 179 1\n0.2 240 0 1\n0.3 0 180 0\n");
  Span<const std::uint8_t> input(bytes);
  Event out[4];
  std::size_t count = 0;
  CHECK(decoder.decode(&input, out, &count) == Status::ok);
  CHECK(count == 1);
  CHECK(decoder.stated_size().width == 240);
  CHECK(decoder.stated_size().height == 180);
  CHECK(decoder.stats().outside == 2);
  CHECK(decode_text("1 2 3 1\n240 180\n").status == Status::malformed_input);
  CHECK(decode_text("0 180\n").status == Status::malformed_input);
}

TEST_CASE("text: events beside a given sensor are counted, time that runs back too") {
  const Decoded decoded = decode_text("5 9 9 1\n4 10 9 1\n3 9 10 1\n", {10, 10});
  CHECK(decoded.events.size() == 1);
  CHECK(decoded.stats.outside == 2);
  CHECK(decoded.stats.time_steps_back == 2);
}

TEST_CASE("text: a broken row is told by line, byte and what was expected") {
  struct Broken {
    const char* text;
    std::uint64_t line;
    std::uint64_t offset;
    const char* expected;
  };
  const Broken cases[] = {
      {"1 2 3 1\n1 2 x 1\n", 2, 12, "y, an integer from 0 to 65535"},
      {"1 2 3\n", 1, 5, "polarity 0, 1 or -1"},
      {"#\n\n1,2,,1\n", 3, 7, "y, an integer from 0 to 65535"},
      {"1 2 3 1 4\n", 1, 8, "the end of the row"},
      {"1 2 3 1,\n", 1, 8, "the end of the row"},
      {"1 2 3 2\n", 1, 7, "polarity 0, 1 or -1"},
      {"1 2 3 -2\n", 1, 8, "polarity 0, 1 or -1"},
      {"1 65536 3 1\n", 1, 7, "x, an integer from 0 to 65535"},
      {"1 -2 3 1\n", 1, 4, "x, an integer from 0 to 65535"},
      {"1 2.0 3 1\n", 1, 3, "x, an integer from 0 to 65535"},
      {"1e-3 2 3 1\n", 1, 1, "a time in seconds or microseconds"},
      {"- 2 3 1\n", 1, 1, "a time in seconds or microseconds"},
      {". 2 3 1\n", 1, 1, "a time in seconds or microseconds"},
      {"1.2.3 2 3 1\n", 1, 3, "a time in seconds or microseconds"},
      {",1 2 3 1\n", 1, 0, "a time in seconds or microseconds"},
      {"a\nb\n", 2, 2, "a time in seconds or microseconds"},
      {"1 2 3 1\nt x y p\n", 2, 8, "a time in seconds or microseconds"},
      {"9223372036854775808 2 3 1\n", 1, 18, "a number below 2^63"},
      {"9223372036855.0 2 3 1\n", 1, 15, "a time below 2^63 microseconds"},
      {"9223372036854.7758075 2 3 1\n", 1, 21, "a time below 2^63 microseconds"},
      {"1 2 3 1\n1 2", 2, 11, "y, an integer from 0 to 65535"},
      {"abc\x01", 1, 3, "text"},
  };
  for (const Broken& broken : cases) {
    CAPTURE(broken.text);
    const Decoded decoded = decode_text(broken.text);
    CHECK(decoded.status == Status::malformed_input);
    CHECK(decoded.expected == broken.expected);
    CHECK(decoded.error_line == broken.line);
    CHECK(decoded.error_offset == broken.offset);
    check_every_split(TextDecoder(), to_bytes(broken.text));
  }
}

TEST_CASE("text: an error sticks, and events before it are given") {
  TextDecoder decoder;
  const Bytes bytes = to_bytes("1 2 3 1\n?\n4 5 6 1\n");
  Span<const std::uint8_t> input(bytes);
  Event out[4];
  std::size_t count = 0;
  CHECK(decoder.decode(&input, {}, &count) == Status::invalid_argument);
  CHECK(decoder.finish({}, &count) == Status::invalid_argument);
  CHECK(decoder.decode(&input, out, &count) == Status::malformed_input);
  CHECK(count == 1);
  CHECK(decoder.stats().events == 1);
  CHECK(decoder.decode(&input, out, &count) == Status::malformed_input);
  CHECK(count == 0);
  CHECK(decoder.finish(out, &count) == Status::malformed_input);
}

TEST_CASE("text: where it is cut changes nothing, and nothing is allocated") {
  const Bytes bytes = to_bytes("% not here\n");
  check_every_split(TextDecoder(), bytes);
  const Bytes good = to_bytes("time x y p\r\n# c\n0.0000015 1 2 1\r\n-.25,3 , 4,-1\n\n 7\t65535 0 0 \n1.5 2 3 1");
  CHECK(decode_whole(TextDecoder(), good).events.size() == 4);
  check_every_split(TextDecoder(), good);

  TextDecoder decoder;
  Span<const std::uint8_t> input(good);
  Event out[8];
  std::size_t count = 0;
  const AllocScope heap;
  const Status status = decoder.decode(&input, out, &count);
  CHECK(heap.allocations() == 0);
  CHECK(status == Status::ok);
}

}  // namespace
}  // namespace lecalib::test
