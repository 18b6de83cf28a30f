// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "lecalib/events/davis_usb_decoder.hpp"
#include "lecalib/events/dvxplorer_usb_decoder.hpp"
#include "lecalib/host/raw_writer.hpp"
#include "lecalib/usb/transport.hpp"

namespace lecalib::usb {

/// Makes words of EVT3 from those that an iniVation camera sends, so that its stream is a recording like any other.
/// Triggers and IMU samples are left out.
class Evt3Stream : public StreamSink {
 public:
  using Decoder = std::variant<DavisUsbDecoder, DvxplorerUsbDecoder>;

  /// @param sensor  of the image
  Evt3Stream(Decoder decoder, SensorSize sensor, StreamSink* sink);

  void take(Span<const std::uint8_t> bytes) override;
  void end(UsbStatus why) override { sink_->end(why); }

 private:
  void encode(Span<Event> events);

  Decoder decoder_;
  host::Evt3Encoder encoder_;
  StreamSink* sink_;
  std::vector<Event> events_;
  std::string words_;
  std::optional<std::int64_t> last_us_;  ///< as encoded
  std::int64_t closed_us_ = 0;           ///< what was taken out of gaps
};

}  // namespace lecalib::usb
