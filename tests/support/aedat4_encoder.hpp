// SPDX-License-Identifier: MIT
/// A writer of AEDAT 4 that shares nothing with the decoder under test. It writes FlatBuffers of the plainest shape.
#pragma once

#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "support/record_encoder.hpp"

namespace lecalib::test {

/// The XML of a header with an event stream 0 of that size, and streams 1 to 3 of frames, IMU samples and triggers.
inline std::string aedat4_xml(int width, int height) {
  std::string xml = "<dv version=\"2.0\">\n<node name=\"outInfo\" path=\"/mainloop/Recorder/outInfo/\">\n";
  const char* types[] = {"EVTS", "FRME", "IMUS", "TRIG"};
  for (int i = 0; i < 4; ++i) {
    xml +=
        "<node name=\"" + std::to_string(i) + "\" path=\"/\">\n<attr key=\"compression\" type=\"string\">LZ4</attr>\n";
    xml += std::string("<attr key=\"typeIdentifier\" type=\"string\">") + types[i] + "</attr>\n";
    xml += "<node name=\"info\" path=\"/\">\n<attr key=\"sizeX\" type=\"int\">" + std::to_string(width) +
           "</attr>\n<attr key=\"sizeY\" type=\"int\">" + std::to_string(height) + "</attr>\n</node>\n</node>\n";
  }
  return xml + "</node>\n</dv>\n";
}

/// First line, length, and a table of compression, place of the data table and XML.
inline Bytes aedat4_header(int compression, const std::string& xml, std::int64_t table_offset = -1) {
  const Bytes vtable = little_endian(10, 2) + little_endian(24, 2) + little_endian(4, 2) + little_endian(8, 2) +
                       little_endian(16, 2) + little_endian(0, 2);
  const Bytes table = little_endian(vtable.size(), 4) + little_endian(static_cast<std::uint64_t>(compression), 4) +
                      little_endian(static_cast<std::uint64_t>(table_offset), 8) + little_endian(8, 4) +
                      little_endian(0, 4);
  const Bytes text = little_endian(xml.size(), 4) + to_bytes(xml);
  const Bytes buffer = little_endian(8 + vtable.size(), 4) + to_bytes("IOHE") + vtable + table + text;
  return to_bytes("#!AER-DAT4.0\r\n") + little_endian(buffer.size(), 4) + buffer;
}

/// A FlatBuffer, its size before it, of a table with one vector.
inline Bytes aedat4_content(const char* type, std::size_t count, const Bytes& elements) {
  const Bytes vtable = little_endian(6, 2) + little_endian(8, 2) + little_endian(4, 2) + little_endian(0, 2);
  const Bytes table = little_endian(vtable.size(), 4) + little_endian(4, 4);
  const Bytes vector = little_endian(count, 4) + elements;
  const Bytes buffer = little_endian(8 + vtable.size(), 4) + to_bytes(type) + vtable + table + vector;
  return little_endian(buffer.size(), 4) + buffer;
}

inline Bytes aedat4_events(const std::vector<Event>& events) {
  Bytes elements;
  for (const Event& e : events) {
    elements = std::move(elements) + little_endian(static_cast<std::uint64_t>(e.t_us), 8) + little_endian(e.x, 2) +
               little_endian(e.y, 2) + little_endian(e.polarity, 4);
  }
  return aedat4_content("EVTS", events.size(), elements);
}

/// `tables` of equal size behind the offsets that lead to them, all with `vtable`.
inline Bytes aedat4_tables(const char* type, const Bytes& vtable, const std::vector<Bytes>& tables) {
  Bytes offsets, behind = vtable;
  for (std::size_t i = 0; i < tables.size(); ++i) {
    const std::size_t back = behind.size();
    offsets = std::move(offsets) + little_endian(4 * (tables.size() - i) + back, 4);
    behind = std::move(behind) + little_endian(back, 4) + tables[i];
  }
  return aedat4_content(type, tables.size(), offsets + behind);
}

/// What the fields of an IMU sample hold: temperature, acceleration x y z (g), rotation x y z (deg/s).
struct Aedat4Imu {
  std::int64_t t_us;
  float values[7];
};

inline Bytes aedat4_imu(const std::vector<Aedat4Imu>& samples) {
  Bytes vtable = little_endian(20, 2) + little_endian(40, 2) + little_endian(4, 2);
  for (std::uint64_t at = 12; at < 40; at += 4) vtable = std::move(vtable) + little_endian(at, 2);
  std::vector<Bytes> tables;
  for (const Aedat4Imu& sample : samples) {
    Bytes table = little_endian(static_cast<std::uint64_t>(sample.t_us), 8);
    for (const float value : sample.values) {
      std::uint32_t bits = 0;
      std::memcpy(&bits, &value, sizeof bits);
      table = std::move(table) + little_endian(bits, 4);
    }
    tables.push_back(table);
  }
  return aedat4_tables("IMUS", vtable, tables);
}

/// @param sources  what each trigger came from: 1 a rising edge, 2 a falling one, 3 a pulse
inline Bytes aedat4_triggers(std::int64_t t_us, const std::vector<int>& sources) {
  const Bytes vtable = little_endian(8, 2) + little_endian(13, 2) + little_endian(4, 2) + little_endian(12, 2);
  std::vector<Bytes> tables;
  for (const int source : sources) {
    tables.push_back(little_endian(static_cast<std::uint64_t>(t_us), 8) +
                     little_endian(static_cast<std::uint64_t>(source), 1));
  }
  return aedat4_tables("TRIG", vtable, tables);
}

inline Bytes aedat4_packet(int stream, const Bytes& content) {
  return little_endian(static_cast<std::uint64_t>(stream), 4) + little_endian(content.size(), 4) + content;
}

/// An LZ4 frame of stored blocks: what LZ4 makes of bytes that cannot be packed. Without any checksum but the
/// header's, which is the second byte of the xxHash32 of the two bytes before it.
inline Bytes lz4_frame(const Bytes& content) {
  Bytes frame = {0x04, 0x22, 0x4D, 0x18, 0x60, 0x40, 0x82};
  for (std::size_t at = 0; at < content.size(); at += 65536) {
    const std::size_t size = std::min<std::size_t>(65536, content.size() - at);
    const auto begin = content.begin() + static_cast<std::ptrdiff_t>(at);
    frame = std::move(frame) + little_endian(0x80000000U + size, 4) +
            Bytes(begin, begin + static_cast<std::ptrdiff_t>(size));
  }
  return frame + little_endian(0, 4);
}

/// A Zstandard frame of raw blocks, content size not stated, window of 1 MiB.
inline Bytes zstd_frame(const Bytes& content) {
  Bytes frame = {0x28, 0xB5, 0x2F, 0xFD, 0x00, 0x50};
  for (std::size_t at = 0;; at += 65536) {
    const std::size_t size = std::min<std::size_t>(65536, content.size() - at);
    const bool is_last = at + size == content.size();
    const auto begin = content.begin() + static_cast<std::ptrdiff_t>(at);
    frame = std::move(frame) + little_endian(size * 8 + (is_last ? 1U : 0U), 3) +
            Bytes(begin, begin + static_cast<std::ptrdiff_t>(size));
    if (is_last) return frame;
  }
}

}  // namespace lecalib::test
