// SPDX-License-Identifier: MIT
#pragma once

#include <memory>

#include "lecalib/usb/camera.hpp"

namespace lecalib::usb {

/// Opens a Prophesee EVK3 or EVK4 with an IMX636: asks it who it is, and refuses other sensors and firmware before 3.8.
/// The sensor is left as it is until start().
host::Result<std::unique_ptr<Camera>> open_treuzell(std::unique_ptr<Transport> transport, const char* name);

}  // namespace lecalib::usb
