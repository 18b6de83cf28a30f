// SPDX-License-Identifier: MIT
#include "lecalib/host/raw_writer.hpp"

#include <algorithm>

#include "lecalib/core/time.hpp"

namespace lecalib::host {
namespace {

/// Upper four bits of a word.
enum class Evt3 : std::uint16_t {
  address_y = 0x0,
  address_x = 0x2,      // bit 11: polarity; one event
  vector_base_x = 0x3,  // bit 11: polarity; moves the vector's origin
  vector_12 = 0x4,      // one event per bit set; then the origin moves on by 12
  vector_8 = 0x5,       // by 8
  time_low = 0x6,
  time_high = 0x8,
};

// Sensors send words of 12, 12 and 8 columns after every base, all of them on the sensor. OpenEB takes the first for
// all three and leaves them out where they reach beyond the sensor.
constexpr unsigned kVectorWidth = 32;
constexpr std::size_t kMinVectorEvents = 5;  // base and vectors are four words: from five events on they are shorter
constexpr unsigned kTimeBits = 12;
constexpr std::int64_t kTimeMask = (1 << kTimeBits) - 1;

constexpr std::int64_t kMaxStepBackUs = 1 << 22;  // a quarter of the clock's range: half of it is a roll-over to many
constexpr std::uint64_t kMaxGapUs = 3'600'000'000;

void put(Evt3 type, unsigned payload, std::string* bytes) {
  const unsigned word = static_cast<unsigned>(type) << 12U | payload;
  bytes->push_back(static_cast<char>(word & 0xFFU));
  bytes->push_back(static_cast<char>(word >> 8U));
}

void put_column(Evt3 type, unsigned x, std::uint8_t polarity, std::string* bytes) {
  put(type, x | (polarity != 0 ? 1U << 11U : 0U), bytes);
}

/// How many of the events from `first` on fit into a vector from column `base_x` on: same time, row and polarity,
/// ascending columns.
std::size_t vector_length(Span<const Event> events, std::size_t first, unsigned base_x) {
  const Event& begin = events[first];
  std::size_t count = 1;
  while (first + count < events.size()) {
    const Event& e = events[first + count];
    if (e.t_us != begin.t_us || e.y != begin.y || e.polarity != begin.polarity) break;
    if (e.x <= events[first + count - 1].x || e.x >= base_x + kVectorWidth) break;
    ++count;
  }
  return count;
}

void put_vector(Span<const Event> events, unsigned base_x, std::string* bytes) {
  std::uint32_t bits = 0;
  for (const Event& e : events) bits |= 1U << (e.x - base_x);
  put_column(Evt3::vector_base_x, base_x, events[0].polarity, bytes);
  put(Evt3::vector_12, bits & 0xFFFU, bytes);
  put(Evt3::vector_12, bits >> 12U & 0xFFFU, bytes);
  put(Evt3::vector_8, bits >> 24U, bytes);
}

}  // namespace

std::string evt3_header(std::uint16_t width, std::uint16_t height, std::map<std::string, std::string> more) {
  const std::string w = std::to_string(width);
  const std::string h = std::to_string(height);
  more.insert({{"camera_integrator_name", "lecalib"},
               {"evt", "3.0"},
               {"format", "EVT3;height=" + h + ";width=" + w},
               {"geometry", w + "x" + h}});
  std::string text;
  for (const auto& [key, value] : more) text.append("% ").append(key).append(" ").append(value).append("\n");
  return text + "% end\n";
}

MaybeError Evt3Encoder::begin(std::string* bytes) const {
  if (width_ == 0 || height_ == 0 || width_ > kMaxEvt3Side || height_ > kMaxEvt3Side) {
    return Error{"EVT3 holds sensors of 1x1 to 2048x2048 pixels"};
  }
  *bytes += evt3_header(width_, height_);
  return std::nullopt;
}

MaybeError Evt3Encoder::check(Span<const Event> events) const {
  std::int64_t last_us = last_us_;
  for (std::size_t i = 0; i < events.size(); ++i) {
    const Event& e = events[i];
    const char* problem = nullptr;
    if (e.x >= width_ || e.y >= height_) problem = "lies outside of the sensor";
    if (e.t_us < 0) problem = "is older than 0";
    if (e.t_us >= 0 && e.t_us < last_us - kMaxStepBackUs) problem = "is older than the one before it by more than 4 s";
    if (count_ + i > 0 && e.t_us > last_us && distance_us(last_us, e.t_us) > kMaxGapUs)
      problem = "comes more than an hour after the one before it";
    if (problem != nullptr)
      return Error{"event " + std::to_string(count_ + i) + " " + problem + ", which EVT3 cannot hold"};
    last_us = e.t_us;
  }
  return std::nullopt;
}

void Evt3Encoder::put_time(std::int64_t t_us, std::string* bytes) {
  const std::int64_t high = t_us >> kTimeBits;
  if (time_high_ < 0 || high < time_high_) time_high_ = high - 1;
  while (time_high_ < high) {
    put(Evt3::time_high, static_cast<unsigned>(++time_high_ & kTimeMask), bytes);
    time_low_ = -1;
  }
  const std::int64_t low = t_us & kTimeMask;
  if (low != time_low_) put(Evt3::time_low, static_cast<unsigned>(low), bytes);
  time_low_ = low;
}

MaybeError Evt3Encoder::append(Span<const Event> events, std::string* bytes) {
  if (MaybeError error = check(events)) return error;
  for (std::size_t i = 0; i < events.size();) {
    const Event& e = events[i];
    put_time(e.t_us, bytes);
    if (e.y != row_) put(Evt3::address_y, e.y, bytes);
    row_ = e.y;
    const bool has_vectors = width_ >= kVectorWidth;
    const unsigned base_x = has_vectors ? std::min<unsigned>(e.x, width_ - kVectorWidth) : 0;
    const std::size_t count = has_vectors ? vector_length(events, i, base_x) : 1;
    if (count < kMinVectorEvents) {
      put_column(Evt3::address_x, e.x, e.polarity, bytes);
      ++i;
      continue;
    }
    put_vector(events.subspan(i, count), base_x, bytes);
    i += count;
  }
  if (!events.empty()) last_us_ = events[events.size() - 1].t_us;
  count_ += events.size();
  return std::nullopt;
}

Result<std::string> encode_evt3(Span<const Event> events, std::uint16_t width, std::uint16_t height) {
  Evt3Encoder encoder(width, height);
  std::string bytes;
  bytes.reserve(6 * events.size());
  if (MaybeError error = encoder.begin(&bytes)) return *std::move(error);
  if (MaybeError error = encoder.append(events, &bytes)) return *std::move(error);
  return bytes;
}

}  // namespace lecalib::host
