// SPDX-License-Identifier: MIT
#include "lecalib/events/dvxplorer_usb_decoder.hpp"
#include "split_decoding.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace lecalib;
  fuzz::check_splits(DvxplorerUsbDecoder(SensorSize{640, 480}), data, size);
  fuzz::check_splits(DvxplorerUsbDecoder(DvxplorerUsbFormat({SensorSize{480, 640}, true, {true, false, true}, 2})),
                     data, size);
  return 0;
}
