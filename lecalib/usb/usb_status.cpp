// SPDX-License-Identifier: MIT
#include "lecalib/usb/usb_status.hpp"

namespace lecalib::usb {

const char* to_string(UsbStatus status) noexcept {
  switch (status) {
    case UsbStatus::ok: return "it worked";
    case UsbStatus::timeout: return "the camera did not answer in time";
    case UsbStatus::stall: return "the camera refused (stall)";
    case UsbStatus::overflow: return "the camera sent more than it was asked for";
    case UsbStatus::no_device: return "the camera was unplugged";
    case UsbStatus::access_denied:
      return "no permission to open the camera: copy 70-lecalib.rules to /etc/udev/rules.d, run 'udevadm control "
             "--reload' and plug the camera in anew";
    case UsbStatus::busy: return "another program uses the camera: close it";
    case UsbStatus::no_memory:
      return "no memory for USB transfers: raise /sys/module/usbcore/parameters/usbfs_memory_mb, or close what else "
             "uses a camera";
    case UsbStatus::failed: break;
  }
  return "the USB transfer failed";
}

}  // namespace lecalib::usb
