// SPDX-License-Identifier: MIT
#include "lecalib/events/aedat2_decoder.hpp"
#include "split_decoding.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace lecalib;
  fuzz::check_splits(Aedat2Decoder(Aedat2Format({346, 260}, Aedat2Layout::davis)), data, size);
  fuzz::check_splits(Aedat2Decoder(Aedat2Format({128, 128}, Aedat2Layout::dvs128)), data, size);
  return 0;
}
