// SPDX-License-Identifier: MIT
#include "lecalib/host/recording_decoder.hpp"

#include <string_view>

namespace lecalib::host {

Status RecordingDecoder::decode(Span<const std::uint8_t>* input, Span<Event> out, std::size_t* count,
                                SideRecords* side) {
  if (aedat4_) return aedat4_->decode(input, out, count, side);
  const Status status = stream_.decode(input, out, count, side);
  if (status != Status::unsupported_format || std::string_view(format_name()) != "AEDAT 4") return status;
  aedat4_.emplace(given_size_);
  // These told the format, so they are taken.
  Span<const std::uint8_t> magic(reinterpret_cast<const std::uint8_t*>(Aedat4Decoder::kMagic.data()),
                                 Aedat4Decoder::kMagic.size());
  (void)aedat4_->decode(&magic, out, count, side);
  return aedat4_->decode(input, out, count, side);
}

Status RecordingDecoder::finish(Span<Event> out, std::size_t* count, SideRecords* side) {
  return aedat4_ ? aedat4_->finish(out, count, side) : stream_.finish(out, count, side);
}

}  // namespace lecalib::host
