// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

namespace lecalib::usb {

/// How a transfer, or opening a device, ended.
enum class [[nodiscard]] UsbStatus : std::uint8_t{
    ok,
    timeout,        ///< no answer in time
    stall,          ///< the device refused, or halted the endpoint
    overflow,       ///< the device sent more than there was room for
    no_device,      ///< unplugged
    access_denied,  ///< the operating system does not let this user open the device
    busy,           ///< another program has claimed it
    no_memory,      ///< the system's limit for USB buffers is used up
    failed,         ///< anything else
};

/// What happened, as the end of a sentence: "the camera was unplugged". Never null.
const char* to_string(UsbStatus status) noexcept;

}  // namespace lecalib::usb
