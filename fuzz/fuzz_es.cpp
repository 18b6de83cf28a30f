// SPDX-License-Identifier: MIT
#include "lecalib/events/es_decoder.hpp"
#include "split_decoding.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace lecalib;
  for (const EsContent content : {EsContent::dvs, EsContent::atis}) {
    fuzz::check_splits(EsDecoder(EsFormat({640, 480}, content)), data, size);
  }
  return 0;
}
