// SPDX-License-Identifier: MIT
// Prints an estimated camera beside the true one: compare_cameras calibration.json truth.json
#include <cstdio>
#include <exception>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>

namespace {

nlohmann::json read_json(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error("cannot open " + path);
  return nlohmann::json::parse(file);
}

std::string four_decimals(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4f", value);
  return text;
}

// One sigma of an intrinsic, or why it has none.
std::string sigma_text(const nlohmann::json& camera, const std::string& name) {
  for (const nlohmann::json& assumed : camera.at("assumed")) {
    if (assumed == name) return "assumed";
  }
  const nlohmann::json& sigma = camera.at("sigma");
  return sigma.contains(name) && sigma.at(name).is_number() ? four_decimals(sigma.at(name)) : "-";
}

void compare(const nlohmann::json& calibration, const nlohmann::json& truth) {
  if (calibration.at("status") != "ok") {
    throw std::runtime_error("the calibration found no camera: " + calibration.at("status").get<std::string>());
  }
  const nlohmann::json& camera = calibration.at("cameras").at(0);
  std::printf("  %-4s %12s %12s %12s %12s\n", "", "true", "estimated", "difference", "sigma");
  for (const char* name : {"fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"}) {
    const double expected = truth.at("camera").value(name, 0.0);
    const double estimate = camera.at(name);
    std::printf("  %-4s %12.4f %12.4f %12.4f %12s\n", name, expected, estimate, estimate - expected,
                sigma_text(camera, name).c_str());
  }
  std::printf("  rms %.3f px over %zu views\n", camera.at("rms_px").get<double>(), calibration.at("views").size());
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 3) throw std::runtime_error("usage: compare_cameras calibration.json truth.json");
  compare(read_json(argv[1]), read_json(argv[2]));
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "compare_cameras: %s\n", error.what());
  return 1;
}
