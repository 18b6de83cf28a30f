// SPDX-License-Identifier: MIT
#include "lecalib/events/dat_decoder.hpp"
#include "split_decoding.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace lecalib;
  for (const unsigned version : {1U, 2U}) fuzz::check_splits(DatDecoder(DatFormat({304, 240}, version)), data, size);
  fuzz::check_splits(DatDecoder(DatFormat({}, 2, DatContent::triggers)), data, size);
  return 0;
}
