// SPDX-License-Identifier: MIT
#include "lecalib/host/aedat4_decoder.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <type_traits>

#include "lecalib/events/side_records.hpp"
#include "lecalib/host/flatbuffer.hpp"

namespace lecalib::host {
namespace {

constexpr std::string_view kFirstLine = "#!AER-DAT4.0\r\n";
constexpr std::size_t kMaxPacketBytes = std::size_t{256} << 20U;
constexpr std::size_t kMaxHeaderBytes = std::size_t{16} << 20U;
constexpr std::size_t kPacketHeadBytes = 8;

/// An event: time, x, y, polarity in one byte and three that say nothing.
constexpr std::size_t kEventBytes = 16;
constexpr std::size_t kXAt = 8, kYAt = 10, kPolarityAt = 12;

/// Packets hold their size before the FlatBuffer.
constexpr std::size_t kRootAt = 4, kIdentifierAt = 8;
constexpr std::string_view kTypes[] = {"EVTS", "IMUS", "TRIG"};

template <class Integer>
Integer load(const std::uint8_t* bytes) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < sizeof(Integer); ++i) value |= static_cast<std::uint64_t>(bytes[i]) << (8U * i);
  return static_cast<Integer>(value);
}

/// Field `index` of a table, of which 0 means that it is not there. @return nothing where it lies beyond the end
template <class Number>
std::optional<Number> number_at(const FlatBuffer& buffer, std::size_t table, std::size_t index) {
  const std::optional<std::size_t> at = buffer.field(table, index);
  if (!at) return std::nullopt;
  if (*at == 0) return Number{0};
  if constexpr (std::is_floating_point_v<Number>) {
    static_assert(sizeof(Number) == sizeof(std::uint32_t));
    const std::optional<std::uint32_t> bits = buffer.read<std::uint32_t>(*at);
    if (!bits) return std::nullopt;
    Number number = 0;
    std::memcpy(&number, &*bits, sizeof number);
    return std::isfinite(number) ? std::optional<Number>(number) : std::nullopt;
  } else {
    return buffer.read<Number>(*at);
  }
}

/// @param at  where the offset of the sample's table stands
/// @return false when the table contradicts itself
bool take_imu_sample(const FlatBuffer& buffer, std::size_t at, SideRecords* side, DecoderStats* stats) {
  enum : std::size_t { kTime, kTemperature, kAccelerations, kRotations = kAccelerations + 3 };
  const std::optional<std::size_t> table = buffer.follow(at);
  if (!table) return false;
  const auto t_us = number_at<std::int64_t>(buffer, *table, kTime);
  const auto temperature = number_at<float>(buffer, *table, kTemperature);
  if (!t_us || !temperature) return false;
  ImuReading reading{*t_us, {}, *temperature, {}};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto acceleration = number_at<float>(buffer, *table, kAccelerations + i);
    const auto rotation = number_at<float>(buffer, *table, kRotations + i);
    if (!acceleration || !rotation) return false;
    reading.accel_g[i] = *acceleration;
    reading.gyro_deg_s[i] = *rotation;
  }
  give_imu_sample(in_camera_axes(reading), side, stats);
  return true;
}

/// As take_imu_sample().
bool take_trigger(const FlatBuffer& buffer, std::size_t at, SideRecords* side, DecoderStats* stats) {
  constexpr std::uint8_t kRising = 1, kFalling = 2, kPulse = 3;
  const std::optional<std::size_t> table = buffer.follow(at);
  if (!table) return false;
  const auto t_us = number_at<std::int64_t>(buffer, *table, 0);
  const auto source = number_at<std::uint8_t>(buffer, *table, 1);
  if (!t_us || !source) return false;
  const TriggerKind kind = *source == kRising    ? TriggerKind::rising
                           : *source == kFalling ? TriggerKind::falling
                           : *source == kPulse   ? TriggerKind::pulse
                                                 : TriggerKind::other;
  give_trigger({*t_us, *source, kind}, side, stats);
  return true;
}

}  // namespace

Status Aedat4Decoder::decode(Span<const std::uint8_t>* input, Span<Event> out, std::size_t* count, SideRecords* side) {
  *count = 0;
  if (out.empty()) return Status::invalid_argument;
  if (is_error(status_)) return status_;
  give_events(out, count);
  while (*count < out.size() && !input->empty() && !is_error(status_)) {
    take(input, side);
    give_events(out, count);
  }
  stats_.events += *count;
  return status_;
}

Status Aedat4Decoder::finish(Span<Event> out, std::size_t* count, SideRecords*) {
  *count = 0;
  if (out.empty()) return Status::invalid_argument;
  if (is_error(status_)) return status_;
  give_events(out, count);
  stats_.events += *count;
  if (next_event_ < events_end_) return status_;
  const bool is_between_packets = part_ == Part::packet_head && piece_.empty();
  if (!is_between_packets && part_ != Part::table) {
    fail(part_ < Part::packet_head ? "a whole AEDAT 4 header" : "a whole last packet");
  }
  return status_;
}

/// Takes bytes of the piece at hand; what lies behind the last packet is passed over.
void Aedat4Decoder::take(Span<const std::uint8_t>* input, SideRecords* side) {
  if (part_ == Part::table) {
    *input = {};
    return;
  }
  const Span<const std::uint8_t> more = input->first(piece_size_ - piece_.size());
  piece_.insert(piece_.end(), more.begin(), more.end());
  *input = input->subspan(more.size());
  if (piece_.size() == piece_size_) end_piece(side);
}

void Aedat4Decoder::end_piece(SideRecords* side) {
  switch (part_) {
    case Part::first_line:
      if (std::memcmp(piece_.data(), kFirstLine.data(), kFirstLine.size()) != 0) return fail("AEDAT 4.0");
      return expect(Part::header_size, sizeof(std::uint32_t));
    case Part::header_size: {
      const auto size = load<std::uint32_t>(piece_.data());
      if (size == 0 || size > kMaxHeaderBytes) return fail("a header of up to 16 MiB");
      return expect(Part::header, size);
    }
    case Part::header: return begin_packets();
    case Part::packet_head: return take_packet_head(side);
    case Part::packet: return take_packet(side);
    case Part::table: return;
  }
}

void Aedat4Decoder::begin_packets() {
  std::optional<Aedat4Header> header = read_aedat4_header(piece_);
  if (!header) return fail("an AEDAT 4 header");
  header_ = std::move(*header);
  for (const auto& [number, stream] : header_.streams) {
    if (events_stream_ || stream.type != "EVTS") continue;
    events_stream_ = number;
    stated_size_ = stream.size;
  }
  expect(Part::packet_head, kPacketHeadBytes);
}

void Aedat4Decoder::take_packet_head(SideRecords* side) {
  stream_ = load<std::int32_t>(piece_.data());
  const auto size = load<std::uint32_t>(piece_.data() + sizeof(std::int32_t));
  if (size > kMaxPacketBytes) return fail("a packet of up to 256 MiB");
  expect(Part::packet, size);
  if (size == 0) take_packet(side);
}

/// Reads the packet in piece_, unless nothing of it is wanted.
void Aedat4Decoder::take_packet(SideRecords* side) {
  std::string_view type;
  const auto known = header_.streams.find(stream_);
  if (known != header_.streams.end()) type = known->second.type;
  const bool is_wanted = type.empty() || std::find(std::begin(kTypes), std::end(kTypes), type) != std::end(kTypes);
  content_.clear();
  if (piece_.empty() || !is_wanted) {
    ++stats_.other_words;
  } else if (const char* expected = decompress(header_.compression, piece_, kMaxPacketBytes, &content_)) {
    return fail(expected);
  } else if (!take_content(content_, type, side)) {
    return fail("a packet as the header describes it");
  }
  expect(Part::packet_head, kPacketHeadBytes);
}

/// @param type by the header; empty when it does not say
/// @return false when the content contradicts itself or the header
bool Aedat4Decoder::take_content(Span<const std::uint8_t> content, std::string_view type, SideRecords* side) {
  const FlatBuffer buffer(content);
  const std::optional<std::size_t> root = buffer.follow(kRootAt);
  if (!root) return false;
  for (const std::string_view known : kTypes) {
    if (type.empty() && buffer.has_identifier(kIdentifierAt, known.data())) type = known;
  }
  if (type.empty()) {
    ++stats_.other_words;
    return true;
  }
  if (!buffer.has_identifier(kIdentifierAt, type.data())) return false;
  const std::optional<std::size_t> field = buffer.field(*root, 0);
  if (!field) return false;
  if (*field == 0) return true;  // no elements
  const bool is_events = type == "EVTS";
  const std::size_t element_bytes = is_events ? kEventBytes : sizeof(std::uint32_t);
  const auto elements = buffer.vector(*field, element_bytes);
  if (!elements) return false;
  const auto first = static_cast<std::size_t>(elements->begin() - content.begin());
  if (!is_events) {
    for (std::size_t at = first; at < first + elements->size(); at += element_bytes) {
      const bool is_whole =
          type == "IMUS" ? take_imu_sample(buffer, at, side, &stats_) : take_trigger(buffer, at, side, &stats_);
      if (!is_whole) ++stats_.undefined_words;
    }
    return true;
  }
  if (!events_stream_) events_stream_ = stream_;
  if (*events_stream_ != stream_) {
    ++stats_.other_words;
    return true;
  }
  next_event_ = first;
  events_end_ = next_event_ + elements->size();
  return true;
}

void Aedat4Decoder::give_events(Span<Event> out, std::size_t* count) {
  const SensorSize size = this->size();
  const bool is_bounded = is_known(size);
  Event* next = out.begin() + *count;
  for (; next != out.end() && next_event_ < events_end_; next_event_ += kEventBytes) {
    const std::uint8_t* bytes = content_.data() + next_event_;
    const auto t_us = load<std::int64_t>(bytes);
    const auto x = load<std::int16_t>(bytes + kXAt);
    const auto y = load<std::int16_t>(bytes + kYAt);
    if (t_us < last_t_us_) ++stats_.time_steps_back;
    last_t_us_ = t_us;
    if (x < 0 || y < 0 || (is_bounded && (x >= size.width || y >= size.height))) {
      ++stats_.outside;
      continue;
    }
    *next++ = {t_us, static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y),
               static_cast<std::uint8_t>(bytes[kPolarityAt] != 0)};
  }
  *count = static_cast<std::size_t>(next - out.begin());
}

/// The next piece, which begins where the one at hand ends.
void Aedat4Decoder::expect(Part part, std::size_t bytes) {
  offset_ += piece_.size();
  piece_.clear();
  piece_size_ = bytes;
  part_ = part;
  const bool is_at_table = header_.table_offset >= 0 && offset_ >= static_cast<std::uint64_t>(header_.table_offset);
  if (part == Part::packet_head && is_at_table) part_ = Part::table;
}

void Aedat4Decoder::fail(const char* expected) {
  error_ = {expected, offset_, 0};
  status_ = Status::malformed_input;
}

}  // namespace lecalib::host
