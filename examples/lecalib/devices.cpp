// SPDX-License-Identifier: MIT
/// lecalib devices: which cameras are plugged in.
#include <cstdio>
#include <string>

#include "commands.hpp"
#include "lecalib/usb/camera.hpp"
#include "lecalib/usb/libusb_transport.hpp"

namespace lecalib::command {
namespace {

void list_devices() {
  const auto bus = take(usb::make_libusb_bus());
  const auto cameras = take(usb::list_cameras(bus.get()));
  if (cameras.empty()) fail({"no camera is plugged in"});
  bool any = false;
  for (const usb::CameraInfo& camera : cameras) {
    const std::string speed =
        camera.device.speed_mbit > 0 ? std::to_string(camera.device.speed_mbit) + " Mbit/s" : "speed not known";
    if (camera.problem.empty()) {
      std::printf("%s  serial %s  %s  firmware %s\n", camera.name.c_str(), camera.serial.c_str(), speed.c_str(),
                  camera.firmware.c_str());
    } else {
      std::printf("%s  %s  cannot be used: %s\n", camera.name.c_str(), speed.c_str(), camera.problem.c_str());
    }
    any = any || camera.problem.empty();
  }
  if (!any) fail({"none of the cameras can be used"});
}

}  // namespace

void add_devices(CLI::App& app) {
  app.add_subcommand("devices", "List the cameras that are plugged in")->callback(&list_devices);
}

}  // namespace lecalib::command
