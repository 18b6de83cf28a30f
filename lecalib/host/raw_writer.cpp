// SPDX-License-Identifier: MIT
#include "lecalib/host/raw_writer.hpp"

namespace lecalib::host {
namespace {

/// Upper four bits of a word.
enum class Evt3 : std::uint16_t {
  address_y = 0x0,
  address_x = 0x2,      // bit 11: polarity; one event
  vector_base_x = 0x3,  // bit 11: polarity; moves the vector's origin
  vector_12 = 0x4,      // one event per bit set; then the origin moves on by 12
  time_low = 0x6,
  time_high = 0x8,
};

constexpr std::size_t kVectorWidth = 12;
constexpr std::size_t kMinVectorEvents = 3;  // base and vector are two words: from three events on they are shorter
constexpr unsigned kTimeBits = 12;
constexpr std::int64_t kTimeMask = (1 << kTimeBits) - 1;

class WordWriter {
 public:
  explicit WordWriter(std::string* bytes) : bytes_(bytes) {}

  void time(std::int64_t t_us) {
    const std::int64_t high = t_us >> kTimeBits;
    if (high_ < 0) high_ = high - 1;
    while (high_ < high) {
      put(Evt3::time_high, static_cast<unsigned>(++high_ & kTimeMask));
      low_ = -1;
    }
    const std::int64_t low = t_us & kTimeMask;
    if (low != low_) put(Evt3::time_low, static_cast<unsigned>(low));
    low_ = low;
  }
  void row(std::uint16_t y) {
    if (y != y_) put(Evt3::address_y, y);
    y_ = y;
  }
  void column(Evt3 type, std::uint16_t x, bool on) { put(type, x | (on ? 1U << 11U : 0U)); }
  void put(Evt3 type, unsigned payload) {
    const unsigned word = static_cast<unsigned>(type) << 12U | payload;
    bytes_->push_back(static_cast<char>(word & 0xFFU));
    bytes_->push_back(static_cast<char>(word >> 8U));
  }

 private:
  std::string* bytes_;
  std::int64_t high_ = -1, low_ = -1;
  int y_ = -1;
};

std::string header(std::uint16_t width, std::uint16_t height) {
  const std::string w = std::to_string(width);
  const std::string h = std::to_string(height);
  return "% camera_integrator_name lecalib\n% evt 3.0\n% format EVT3;height=" + h + ";width=" + w + "\n% geometry " +
         w + "x" + h + "\n% end\n";
}

/// How many of the events from `first` on fit into one vector: same time, row and polarity, ascending columns.
std::size_t vector_length(Span<const Event> events, std::size_t first) {
  const Event& base = events[first];
  std::size_t count = 1;
  while (first + count < events.size()) {
    const Event& e = events[first + count];
    if (e.t_us != base.t_us || e.y != base.y || e.polarity != base.polarity) break;
    if (e.x <= events[first + count - 1].x || e.x >= base.x + kVectorWidth) break;
    ++count;
  }
  return count;
}

MaybeError check(Span<const Event> events, std::uint16_t width, std::uint16_t height) {
  if (width == 0 || height == 0 || width > kMaxEvt3Side || height > kMaxEvt3Side) {
    return Error{"EVT3 holds sensors of 1x1 to 2048x2048 pixels"};
  }
  std::int64_t last_us = 0;
  for (std::size_t i = 0; i < events.size(); ++i) {
    const Event& e = events[i];
    if (e.x >= width || e.y >= height) return Error{"event " + std::to_string(i) + " lies outside of the sensor"};
    if (e.t_us < last_us) return Error{"event " + std::to_string(i) + " is older than the one before it, or than 0"};
    last_us = e.t_us;
  }
  return {};
}

}  // namespace

Result<std::string> encode_evt3(Span<const Event> events, std::uint16_t width, std::uint16_t height) {
  if (MaybeError error = check(events, width, height)) return *std::move(error);
  std::string bytes = header(width, height);
  bytes.reserve(bytes.size() + 6 * events.size());
  WordWriter words(&bytes);
  for (std::size_t i = 0; i < events.size();) {
    const Event& e = events[i];
    words.time(e.t_us);
    words.row(e.y);
    const std::size_t count = vector_length(events, i);
    if (count < kMinVectorEvents) {
      words.column(Evt3::address_x, e.x, e.polarity != 0);
      ++i;
      continue;
    }
    words.column(Evt3::vector_base_x, e.x, e.polarity != 0);
    unsigned bits = 0;
    for (std::size_t k = 0; k < count; ++k) bits |= 1U << (events[i + k].x - e.x);
    words.put(Evt3::vector_12, bits);
    i += count;
  }
  return bytes;
}

}  // namespace lecalib::host
