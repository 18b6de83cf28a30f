// SPDX-License-Identifier: MIT
#include "lecalib/host/json_writer.hpp"

#include <doctest/doctest.h>

#include <limits>

#include "support/json_file.hpp"

using lecalib::host::JsonWriter;

TEST_CASE("json: text is laid out in lines or on one line") {
  JsonWriter json;
  json.begin_object();
  json.member("a", 1);
  json.key("b");
  json.begin_array();
  json.begin_object(JsonWriter::Layout::one_line);
  json.member("x", true);
  json.key("y");
  json.begin_array();
  json.value("z");
  json.null();
  json.end();
  json.end();
  json.end();
  json.key("empty");
  json.begin_object();
  json.end();
  json.end();
  CHECK(json.text() ==
        "{\n"
        "  \"a\": 1,\n"
        "  \"b\": [\n"
        "    {\"x\": true, \"y\": [\"z\", null]}\n"
        "  ],\n"
        "  \"empty\": {}\n"
        "}\n");
}

TEST_CASE("json: another reader gets back what was written") {
  const double numbers[] = {0.1, -1e-300, 3, 1.0 / 3.0};
  const std::string text = std::string("quote \" back \\ tab \t nul ") + '\0' + " ü";
  JsonWriter json;
  json.begin_object();
  json.key("numbers");
  json.numbers(numbers);
  json.member("text", text);
  json.member("big", std::numeric_limits<std::uint64_t>::max());
  json.member("nan", std::numeric_limits<double>::quiet_NaN());
  json.member("inf", std::numeric_limits<double>::infinity());
  json.end();
  const auto read = lecalib::test::json_in(json.text());
  for (std::size_t i = 0; i < 4; ++i) CHECK(read["numbers"][i].get<double>() == numbers[i]);
  CHECK(read["text"].get<std::string>() == text);
  CHECK(read["big"].get<std::uint64_t>() == std::numeric_limits<std::uint64_t>::max());
  CHECK(read["nan"].is_null());
  CHECK(read["inf"].is_null());
}
