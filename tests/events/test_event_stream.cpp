// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <map>
#include <string>

#include "lecalib/events/event_stream.hpp"
#include "support/decode_pieces.hpp"
#include "support/opened_stream.hpp"
#include "support/random_events.hpp"
#include "support/record_encoder.hpp"
#include "support/shared_data.hpp"

namespace lecalib::test {
namespace {

const std::vector<Word> kEvt3Words = {{8, 3}, {6, 7}, {0, 100}, {2, 200}};
const std::vector<Event> kEvt3Events = {{3 * 4096 + 7, 200, 100, 0}};

TEST_CASE("stream: a RAW header gives format and size") {
  for (const std::string header :
       {"% evt 3.0\n% geometry 640x480\n% end\n", "% format EVT3;height=480;width=640\n",
        "% date today\r\n% evt 3.0 \r\n% format EVT3;width=640;height=480\r\n% geometry 640x480\r\n% end\r\n"}) {
    CAPTURE(header);
    const Bytes bytes = to_bytes(header) + evt3_bytes(kEvt3Words);
    const Opened opened = open(bytes);
    CHECK(opened.decoded.status == Status::ok);
    CHECK(opened.decoded.events == kEvt3Events);
    CHECK(opened.format == EventFormat::evt3);
    CHECK(opened.format_name == "EVT3");
    CHECK(opened.stated.width == 640);
    CHECK(opened.stated.height == 480);
    check_every_split(EventStreamDecoder(), bytes);
  }
}

TEST_CASE("stream: the caller's size counts where the header states none") {
  const Bytes bytes = to_bytes("% evt 3.0\n") + evt3_bytes(kEvt3Words);
  const Opened unknown = open(bytes);
  CHECK(unknown.decoded.events.size() == 1);
  CHECK_FALSE(is_known(unknown.size));
  const Opened small = open(bytes, {200, 200});
  CHECK(small.decoded.events.empty());
  CHECK(small.decoded.stats.outside == 1);
  CHECK_FALSE(is_known(small.stated));
  CHECK(small.size.width == 200);
  const Opened stated = open(to_bytes("% geometry 201x201\n") + bytes, {200, 200});
  CHECK(stated.decoded.events.size() == 1);
  CHECK(stated.size.width == 201);
  CHECK(open(to_bytes("% geometry 99999x12z\n") + bytes).stated.width == 0);
}

TEST_CASE("stream: events that begin with the byte of '%' are no header") {
  // Without "% end" the first words' bytes look like the begin of one more line.
  for (const std::vector<Word>& words :
       {std::vector<Word>{{8, 0x025}, {0, 1}, {2, 0xA0A}},
        std::vector<Word>{{2, 0x025}, {2, 0x020}, {8, 0x025}, {0, 1}, {2, 5}}, std::vector<Word>{{8, 0x025}}}) {
    const Bytes header = to_bytes("% evt 3.0\n");
    const Decoded plain = decode_whole(Evt3Decoder(), evt3_bytes(words));
    const Bytes bytes = header + evt3_bytes(words);
    const Decoded decoded = decode_whole(EventStreamDecoder(), bytes);
    CHECK(decoded == plain);
    check_every_split(EventStreamDecoder(), bytes);
  }
  // EVT2: '%', ' ' and a printable byte before the type: held back as a header line until the fourth byte.
  const std::vector<Word> words = {{1, 0x412025}, {8, 2}, {1, 0x412025}};
  const Bytes bytes = to_bytes("% evt 2.0\n") + evt2_bytes(words);
  CHECK(decode_whole(EventStreamDecoder(), bytes) == decode_whole(Evt2Decoder(), evt2_bytes(words)));
  check_every_split(EventStreamDecoder(), bytes);
  // After "% end" nothing is a header.
  const Bytes ended = to_bytes("% evt 3.0\n% end\n") + evt3_bytes({{2, 0x025}, {2, 0x020}, {0, 0xA20}});
  CHECK(decode_whole(EventStreamDecoder(), ended).stats.unplaced == 2);
}

TEST_CASE("stream: EVT2.1 words come in the order that the header states") {
  const std::vector<Event> expected{{3 * 64 + 7, 33, 2, 1}};
  const std::vector<Word64> words = {{8, 3, 0}, {1, 7U << 22U | 32U << 11U | 2U, 2}};
  for (const std::string header : {"% evt 2.1\n% geometry 320x320\n% end\n", "% format EVT21;height=320;width=320\n",
                                   "% endianness little\n% evt 2.1\n% geometry 320x320\n"}) {
    CAPTURE(header);
    const Opened opened = open(to_bytes(header) + evt21_bytes(words));
    CHECK(opened.format_name == "EVT2.1");
    CHECK(opened.decoded.events == expected);
    CHECK(opened.stated.width == 320);
    check_every_split(EventStreamDecoder(), to_bytes(header) + evt21_bytes(words));
  }
  for (const std::string header :
       {"% format EVT21;endianness=legacy;height=320;width=320\n% end\n", "% evt 2.1\n% endianness legacy\n"}) {
    CAPTURE(header);
    CHECK(open(to_bytes(header) + evt21_bytes(words, true)).decoded.events == expected);
  }
}

TEST_CASE("stream: a DAT header ends with two bytes, after '% end' or without it") {
  const std::vector<Event> expected{{7, 300, 200, 1}};
  for (const std::string header :
       {"% Data file containing CD events.\n% Version 2\n% Date today\n% Height 240\n% Width 304\n",
        "% Height 240\n% Version 2\n% Width 304\n% end\n", "% Data file\r\n% Version 2\r\n% end\r\n"}) {
    for (const std::uint8_t type : Bytes{0, 12}) {
      CAPTURE(header);
      const Bytes bytes = to_bytes(header) + Bytes{type, 8} + encode_dat(expected);
      const Opened opened = open(bytes);
      CHECK(opened.format_name == "DAT");
      CHECK(opened.decoded.events == expected);
      CHECK(opened.stated.width == (header.find("304") == std::string::npos ? 0 : 304));
      check_every_split(EventStreamDecoder(), bytes);
    }
  }
  // Without a version, or with the first one, addresses are narrower.
  for (const std::string header : {"% Data file\n", "% Data file\n% Version 1\n"}) {
    CHECK(open(to_bytes(header) + Bytes{0, 8} + encode_dat(expected, 1)).decoded.events == expected);
  }
  for (const std::string cut : {"% Data file\n", "% Data file\n% end\n", "% Data file\n% end\n\x0c"}) {
    CHECK(open(to_bytes(cut)).decoded.status == Status::ok);
    check_every_split(EventStreamDecoder(), to_bytes(cut));
  }
  // A RAW header says evt, whatever else it says.
  CHECK(open(to_bytes("% evt 3.0\n% Version 2\n") + evt3_bytes(kEvt3Words)).decoded.events == kEvt3Events);
}

TEST_CASE("stream: the byte behind a DAT header tells events from triggers") {
  const std::vector<TriggerEvent> triggers = {{3, 1, TriggerKind::rising}, {8, 1, TriggerKind::falling}};
  const Bytes bytes = to_bytes("% Data file containing Trigger events.\n% Version 2\n% end\n") + Bytes{14, 8} +
                      encode_dat_triggers(triggers);
  const Opened opened = open(bytes);
  CHECK(opened.format_name == "DAT of triggers");
  CHECK(opened.format == EventFormat::dat);
  CHECK(opened.decoded.triggers == triggers);
  CHECK(opened.decoded.events.empty());
  check_every_split(EventStreamDecoder(), bytes);
}

TEST_CASE("stream: the chip in an AEDAT 2 header tells how addresses are read") {
  const std::string begin =
      "#!AER-DAT2.0\r\n# This is a raw AE data file - do not edit\r\n# created in /home/J\xC3\xB6rg\r\n";
  const std::vector<Event> expected{{9, 100, 20, 1}, {12, 3, 4, 0}};
  struct Case {
    std::string line;
    int width, height;
  };
  for (const Case& chip :
       {Case{"# AEChip: eu.seebetter.ini.chips.davis.DAVIS240C\r\n", 240, 180},
        Case{"# AEChip: eu.seebetter.ini.chips.davis.Davis346blue\r\n", 346, 260},
        Case{"# AEChip: ch.unizh.ini.jaer.chip.retina.DVS128\r\n#End Of ASCII Header\r\n", 128, 128}}) {
    CAPTURE(chip.line);
    const Bytes events = chip.width == 128 ? encode_dvs128(expected) : encode_davis(expected, chip.width, chip.height);
    const Bytes bytes = to_bytes(begin + chip.line) + events;
    const Opened opened = open(bytes);
    CHECK(opened.format_name == "AEDAT 2");
    CHECK(opened.stated.width == chip.width);
    CHECK(opened.stated.height == chip.height);
    CHECK(opened.decoded.events == expected);
    check_every_split(EventStreamDecoder(), bytes);
  }
  // A file that names no chip is read with the caller's size, or not at all.
  CHECK(open(to_bytes(begin) + encode_davis(expected, 240, 180), {240, 180}).decoded.events == expected);
  CHECK(open(to_bytes(begin) + encode_dvs128(expected), {128, 128}).decoded.events == expected);
  const Opened refused = open(to_bytes(begin) + encode_davis(expected, 240, 180));
  CHECK(refused.decoded.status == Status::unsupported_format);
  CHECK(refused.decoded.expected == "the sensor's size, or a line '# AEChip: NAME' with a known chip");
}

TEST_CASE("stream: AEDAT 2 events that begin with the byte of '#' are no header") {
  // Rows whose upper bits are 0x23, with columns whose upper bits are LF or CR.
  std::vector<Event> events;
  for (int row = 140; row < 144; ++row) {
    for (int column = 0; column < 346; ++column) {
      events.push_back({0, static_cast<std::uint16_t>(345 - column), static_cast<std::uint16_t>(259 - row), 1});
    }
  }
  for (const char* line_end : {"\r\n", "\n"}) {
    const std::string header = std::string("#!AER-DAT2.0") + line_end + "# AEChip: DAVIS346" + line_end;
    std::size_t different = 0;
    for (const Event& event : events) {
      const std::vector<Event> one{event};
      const Decoded decoded = decode_whole(EventStreamDecoder(), to_bytes(header) + encode_davis(one, 346, 260));
      if (!(decoded.events == one)) ++different;
    }
    CAPTURE(line_end);
    // Where lines end with LF alone, such columns of row 140 cannot be told from an empty line.
    CHECK(different == (line_end[0] == '\r' ? 0 : 16));
  }
}

TEST_CASE("stream: an Event Stream header gives content and size") {
  const std::vector<Event> expected{{9, 100, 20, 1}, {200, 3, 4, 0}};
  const Bytes bytes = es_header(1, 640, 480) + encode_es(expected, 480);
  const Opened opened = open(bytes, {10, 10});
  CHECK(opened.format_name == "Event Stream");
  CHECK(opened.decoded.events == expected);
  CHECK(opened.stated.width == 640);
  CHECK(opened.stated.height == 480);
  check_every_split(EventStreamDecoder(), bytes);
  const Opened atis = open(es_header(2, 304, 240) + Bytes{2, 1, 0, 2, 0});
  CHECK(atis.decoded.events == std::vector<Event>{{0, 1, 237, 1}});
}

TEST_CASE("stream: header lines of any length") {
  const Bytes bytes =
      to_bytes("% evt 3.0\n% note " + std::string(5000, '.') + "\n%\n% geometry 640x480\n") + evt3_bytes(kEvt3Words);
  const Opened opened = open(bytes);
  CHECK(opened.decoded.events == kEvt3Events);
  CHECK(opened.stated.width == 640);
}

TEST_CASE("stream: a file of header alone has no events") {
  for (const char* header : {"% evt 3.0\n", "% evt 3.0", "% evt 2.0\n% end\n", "% evt 2.0\n% end", "% evt 3.0\n%"}) {
    CAPTURE(header);
    const Decoded decoded = decode_whole(EventStreamDecoder(), to_bytes(header));
    CHECK(decoded.status == Status::ok);
    CHECK(decoded.events.empty());
    check_every_split(EventStreamDecoder(), to_bytes(header));
  }
}

TEST_CASE("stream: text is told by its first byte") {
  const std::vector<Event> expected{{7, 1, 2, 1}};
  for (const char* text :
       {"7 1 2 1\n", "t,x,y,p\n7,1,2,1\n", "# a comment\n7 1 2 1", "\n7 1 2 1\n", "SQL x y p\n7 1 2 1\n"}) {
    CAPTURE(text);
    const Opened opened = open(to_bytes(text));
    CHECK(opened.decoded.events == expected);
    CHECK(opened.format == EventFormat::text);
    CHECK(opened.format_name == "text");
    check_every_split(EventStreamDecoder(), to_bytes(text));
  }
  CHECK(decode_whole(EventStreamDecoder(), to_bytes("7")).status == Status::malformed_input);
  const Opened sized = open(to_bytes("240 180\n7 240 2 1\n"));
  CHECK(sized.stated.width == 240);
  CHECK(sized.decoded.stats.outside == 1);
}

TEST_CASE("stream: formats that are not read are named") {
  const std::map<std::string, std::string> names = {
      {"#!AER-DAT4.0\r\n", "AEDAT 4"},
      {"#!AER-DAT3.1\r\n", "AEDAT 3"},
      {"#!AER-DAT1.0\r\n", "AEDAT"},
      {"Event Stream", "Event Stream that ends in its header"},
      {"Event Stream\x02\x01\x02\x01\x80\x02", "Event Stream that ends in its header"},
      {"Event Stream\x01\x01\x01\x01", "Event Stream of a version other than 2"},
      {"Event Stream\x02\x01\x02\x04\x80\x02\xE0\x01", "Event Stream without DVS or ATIS events"},
      {"#ROSBAG V2.0\n", "ROS bag"},
      {"\x89HDF\r\n\x1a\n", "HDF5"},
      {"\x1f\x8b\x08", "gzip"},
      {"PK\x03\x04", "zip"},
      {"SQLite format 3", "SQLite (ROS 2 bag)"},
      {"\xef\xbb\xbf"
       "1 2 3 1\n",
       "text with a byte order mark"},
      {"% Data file containing CD events.\n% Version 2\n\x0e\x10",
       "DAT of records that are neither CD events nor triggers"},
      {"% Data file containing CD events.\n% Version 2\n\x0c\x10",
       "DAT of records that are neither CD events nor triggers"},
      {"% evt 4.0\n\x80\x80", "EVT4"},
      {"% date\n% end\n", "'%' header without a known evt or format"},
      {"%!PS", "'%' header without a known evt or format"},
      {"\x01\x02", "unknown"},
  };
  for (const auto& [text, name] : names) {
    const Opened opened = open(to_bytes(text));
    CHECK(opened.format_name == name);
    CHECK(opened.format == EventFormat::unknown);
    CHECK(opened.decoded.status == Status::unsupported_format);
    check_every_split(EventStreamDecoder(), to_bytes(text));
  }
}

TEST_CASE("stream: an empty one is malformed") {
  const Decoded decoded = decode_whole(EventStreamDecoder(), {});
  CHECK(decoded.status == Status::malformed_input);
  CHECK(decoded.expected == "Prophesee RAW (EVT2, EVT2.1, EVT3) or DAT, AEDAT 2, Event Stream 2 or text");
  EventStreamDecoder decoder;
  Span<const std::uint8_t> nothing;
  std::size_t count = 0;
  CHECK(decoder.decode(&nothing, {}, &count) == Status::invalid_argument);
  CHECK(decoder.finish({}, &count) == Status::invalid_argument);
}

TEST_CASE("stream: an error's place counts from the first byte of the stream") {
  const Bytes bytes = to_bytes("% evt 3.0\n") + evt3_bytes(kEvt3Words) + Bytes{1};
  const Decoded decoded = decode_whole(EventStreamDecoder(), bytes);
  CHECK(decoded.status == Status::malformed_input);
  CHECK(decoded.error_offset == bytes.size() - 1);
  CHECK(decoded.events == kEvt3Events);
  const Decoded text = decode_whole(EventStreamDecoder(), to_bytes("1 2 3 1\n1 2 3 5\n"));
  CHECK(text.error_line == 2);
  CHECK(text.error_offset == 15);
}

}  // namespace
}  // namespace lecalib::test
