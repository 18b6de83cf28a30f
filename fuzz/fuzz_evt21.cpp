// SPDX-License-Identifier: MIT
#include "lecalib/events/evt21_decoder.hpp"
#include "split_decoding.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace lecalib;
  for (const Evt21Order order : {Evt21Order::little, Evt21Order::legacy}) {
    fuzz::check_splits(Evt21Decoder(Evt21Format({320, 320}, order)), data, size);
  }
  return 0;
}
