// SPDX-License-Identifier: MIT
#pragma once

#include <memory>

#include "lecalib/usb/camera.hpp"

namespace lecalib::usb {

/// Opens an iniVation DAVIS346 or DVXplorer with an FX3: asks it who it is, and refuses firmware and logic that are too
/// old. The sensor is left as it is until start(). Its stream is turned into EVT3.
host::Result<std::unique_ptr<Camera>> open_davis346(std::unique_ptr<Transport> transport, const char* name);
host::Result<std::unique_ptr<Camera>> open_dvxplorer(std::unique_ptr<Transport> transport, const char* name);

}  // namespace lecalib::usb
