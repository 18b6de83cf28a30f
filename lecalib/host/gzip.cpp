// SPDX-License-Identifier: MIT
#include "lecalib/host/gzip.hpp"

#ifdef LECALIB_HAS_ZLIB
#include <zlib.h>

#include <limits>
#endif

namespace lecalib::host {

#ifdef LECALIB_HAS_ZLIB

struct GzipReader::State {
  State() { is_ready = ::inflateInit2(&stream, kGzipOnly) == Z_OK; }
  State(const State&) = delete;
  State& operator=(const State&) = delete;
  ~State() { ::inflateEnd(&stream); }

  static constexpr int kGzipOnly = 16 + MAX_WBITS;
  z_stream stream = {};
  bool is_ready = false;
  bool is_in_member = false;
};

bool GzipReader::is_available() { return true; }

GzipReader::GzipReader() : state_(std::make_unique<State>()) {}

bool GzipReader::read(Span<const std::uint8_t>* input, Span<std::uint8_t> out, std::size_t* count) {
  *count = 0;
  z_stream& stream = state_->stream;
  bool is_whole = state_->is_ready;
  while (is_whole && *count < out.size() && (!input->empty() || state_->is_in_member)) {
    constexpr std::size_t kMax = std::numeric_limits<uInt>::max();
    const Span<const std::uint8_t> in = input->first(kMax);
    const Span<std::uint8_t> room = out.subspan(*count, kMax);
    stream.next_in = const_cast<std::uint8_t*>(in.data());  // zlib only reads it
    stream.avail_in = static_cast<uInt>(in.size());
    stream.next_out = room.data();
    stream.avail_out = static_cast<uInt>(room.size());
    state_->is_in_member = true;
    const int result = ::inflate(&stream, Z_NO_FLUSH);
    *input = input->subspan(in.size() - stream.avail_in);
    *count += room.size() - stream.avail_out;
    if (result == Z_BUF_ERROR) break;  // all input is used
    if (result == Z_STREAM_END) {      // another member may follow
      state_->is_in_member = false;
      is_whole = ::inflateReset(&stream) == Z_OK;
    } else {
      is_whole = result == Z_OK;
    }
  }
  return is_whole;
}

bool GzipReader::is_between_members() const { return !state_->is_in_member; }

#else

struct GzipReader::State {};

bool GzipReader::is_available() { return false; }
GzipReader::GzipReader() = default;
bool GzipReader::read(Span<const std::uint8_t>*, Span<std::uint8_t>, std::size_t* count) {
  *count = 0;
  return false;
}
bool GzipReader::is_between_members() const { return false; }

#endif

GzipReader::GzipReader(GzipReader&&) noexcept = default;
GzipReader& GzipReader::operator=(GzipReader&&) noexcept = default;
GzipReader::~GzipReader() = default;

}  // namespace lecalib::host
