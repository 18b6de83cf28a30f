// SPDX-License-Identifier: MIT
#include "lecalib/events/evt3_decoder.hpp"
#include "split_decoding.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  lecalib::fuzz::check_splits(lecalib::Evt3Decoder(lecalib::SensorSize{640, 480}), data, size);
  return 0;
}
