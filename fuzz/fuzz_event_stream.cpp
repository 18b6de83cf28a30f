// SPDX-License-Identifier: MIT
#include "lecalib/events/event_stream.hpp"
#include "split_decoding.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  lecalib::fuzz::check_splits(lecalib::EventStreamDecoder(), data, size);
  return 0;
}
