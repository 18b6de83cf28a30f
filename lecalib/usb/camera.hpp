// SPDX-License-Identifier: MIT
/// Live cameras, whoever makes them: which are plugged in, opening one, its settings, its stream.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "lecalib/events/decoder.hpp"
#include "lecalib/host/error.hpp"
#include "lecalib/usb/transport.hpp"

namespace lecalib::usb {

/// A camera that is plugged in.
struct CameraInfo {
  DeviceInfo device;
  std::string name;      ///< "Prophesee EVK4"
  std::string serial;    ///< empty where it could not be read
  std::string firmware;  ///< as its maker writes it; empty where it could not be read
  std::string problem;   ///< why it cannot be used; empty if it can
};

struct BiasOffset {
  std::string name;
  int offset = 0;  ///< from the value that the camera has when it is switched on
};

/// Columns [x, x + width) and rows [y, y + height) of the sensor.
struct Roi {
  std::uint16_t x = 0, y = 0, width = 0, height = 0;
};

struct CameraSettings {
  std::vector<BiasOffset> biases;
  std::optional<Roi> roi;              ///< none: the whole sensor
  std::uint32_t max_events_per_s = 0;  ///< the camera itself drops what is beyond; 0: no limit
};

/// An open camera. What goes wrong is said in one line that tells what to do about it.
class Camera {
 public:
  virtual ~Camera() = default;
  [[nodiscard]] virtual const CameraInfo& info() const = 0;
  [[nodiscard]] virtual SensorSize sensor() const = 0;
  /// The header under which the bytes of the stream are a recording. It has an even number of bytes, so that words do
  /// not lie across pages of a file.
  [[nodiscard]] virtual std::string file_header() const = 0;
  /// Bytes of the stream's words.
  [[nodiscard]] virtual std::size_t word_bytes() const = 0;

  /// Sets the sensor up and lets it send; *sink gets the stream until its end() was called.
  virtual host::MaybeError start(const CameraSettings& settings, StreamSink* sink) = 0;
  /// Makes the sensor silent and ends the stream. Nothing happens when it does not run or is unplugged.
  virtual void stop() = 0;
  [[nodiscard]] virtual StreamStats stream_stats() const = 0;
};

/// All cameras that are plugged in, also those that cannot be used. Opens each for a moment.
host::Result<std::vector<CameraInfo>> list_cameras(Bus* bus);

/// Opens the camera with this serial number (upper or lower case), or the only one if it is empty.
host::Result<std::unique_ptr<Camera>> open_camera(Bus* bus, const std::string& serial);

}  // namespace lecalib::usb
