// SPDX-License-Identifier: MIT
#include "lecalib/host/recording_decoder.hpp"
#include "split_decoding.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  lecalib::fuzz::check_splits(lecalib::host::RecordingDecoder(), data, size);
  return 0;
}
