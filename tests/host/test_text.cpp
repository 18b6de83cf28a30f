// SPDX-License-Identifier: MIT
#include "lecalib/host/text.hpp"

#include <doctest/doctest.h>

#include <clocale>

using namespace lecalib::host;

TEST_CASE("lines end at LF, CRLF or the end of the text") {
  LineReader reader(
      "\xEF\xBB\xBF"
      "a\r\n\nb");
  std::string_view line;
  REQUIRE(reader.next(&line));
  CHECK(line == "a");
  REQUIRE(reader.next(&line));
  CHECK(line == "");
  REQUIRE(reader.next(&line));
  CHECK(line == "b");
  CHECK(reader.number() == 3);
  CHECK_FALSE(reader.next(&line));
  CHECK(line == "b");
}

TEST_CASE("comments and white space before them are cut") {
  CHECK(without_comment("1 2 \t# three") == "1 2");
  CHECK(without_comment("# all") == "");
  CHECK(without_comment("  ") == "");
}

TEST_CASE("fields know their column") {
  const auto blanks = split_blanks("  a\tbc ");
  REQUIRE(blanks.size() == 2);
  CHECK(blanks[0].text == "a");
  CHECK(blanks[0].column == 3);
  CHECK(blanks[1].text == "bc");
  CHECK(blanks[1].column == 5);
  CHECK(split_blanks("").empty());

  const auto commas = split("a, b ,,", ',');
  REQUIRE(commas.size() == 4);
  CHECK(commas[1].text == "b");
  CHECK(commas[1].column == 4);
  CHECK(commas[2].text == "");
  CHECK(commas[3].text == "");
  CHECK(split("", ',').size() == 1);
}

TEST_CASE("numbers are finite, whole fields, and the same in every locale") {
  CHECK(parse_number("+1.5e-3") == 1.5e-3);
  CHECK(parse_number("-.5") == -0.5);
  for (const char* bad : {"", "nan", "inf", "-inf", "1.5px", "1,5", "+-1", "1e999", "0x10", " 1"}) {
    CAPTURE(bad);
    CHECK_FALSE(parse_number(bad));
  }
  CHECK(parse_count("12") == 12);
  CHECK_FALSE(parse_count("-1"));
  CHECK_FALSE(parse_count("1.0"));
  CHECK_FALSE(parse_count("99999999999999999999999"));
  const char* german = std::setlocale(LC_NUMERIC, "de_DE.UTF-8");
  CHECK(parse_number("1.25") == 1.25);
  if (german != nullptr) std::setlocale(LC_NUMERIC, "C");
}

TEST_CASE("what is quoted in a message is short and printable") {
  CHECK(quoted("a\n\x01"
               "b") == "'a??b'");
  CHECK(lecalib::host::quoted(std::string(100, 'x')) == "'" + std::string(40, 'x') + "...'");
}

TEST_CASE("numbers are written without the locale and read back the same") {
  CHECK(fixed(-1.23456, 3) == "-1.235");
  CHECK(fixed(1e300, 0).size() == 301);
  CHECK(shortest(0.1) == "0.1");
  CHECK(parse_number(shortest(1.0 / 3.0)) == 1.0 / 3.0);
}
