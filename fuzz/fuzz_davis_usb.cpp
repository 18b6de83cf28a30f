// SPDX-License-Identifier: MIT
#include "lecalib/events/davis_usb_decoder.hpp"
#include "split_decoding.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace lecalib;
  fuzz::check_splits(DavisUsbDecoder(SensorSize{346, 260}), data, size);
  fuzz::check_splits(DavisUsbDecoder(DavisUsbFormat({SensorSize{260, 346}, true, {true, false, true}, 2})), data, size);
  return 0;
}
