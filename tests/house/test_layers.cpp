// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <map>
#include <set>
#include <string>

#include "house/source_files.hpp"

namespace {

using lecalib::test::Include;
using lecalib::test::SourceFile;

// What each room may include beside itself. The five stages do not know of each other.
const std::map<std::string, std::set<std::string>> kMayInclude = {
    {"core", {}},
    {"math", {"core"}},
    {"events", {"core", "math"}},
    {"planes", {"core", "math"}},
    {"segments", {"core", "math"}},
    {"match", {"core", "math"}},
    {"solve", {"core", "math"}},
    {"pipeline", {"core", "math", "events", "planes", "segments", "match", "solve"}},
    {"c", {"core", "pipeline"}},
    {"host", {"core", "math", "events", "planes", "segments", "match", "solve", "pipeline"}},
    {"usb", {"core", "events", "host"}},
};

// Rooms that run on a microcontroller take only these headers of the standard library: they neither allocate nor print.
const std::set<std::string> kFreestandingEnough = {"algorithm",   "array",       "atomic", "cmath", "cstddef",
                                                   "cstdint",     "cstring",     "limits", "new",   "numeric",
                                                   "string_view", "type_traits", "utility"};

bool is_host(const std::string& room) { return room == "host" || room == "usb"; }

// Why the file may not have this include; empty if it may.
std::string objection(const SourceFile& file, const Include& include) {
  const std::string room = file.room();
  if (include.quoted) {
    if (include.target.rfind("lecalib/", 0) != 0) return "is not written as lecalib/room/file.hpp";
    const std::string other = SourceFile{include.target, {}, {}}.room();
    if (other != room && kMayInclude.at(room).count(other) == 0) return "goes against the layers";
    return {};
  }
  if (include.target.rfind("Eigen", 0) == 0 || include.target.rfind("unsupported", 0) == 0) {
    return file.path == "lecalib/math/eigen.hpp" ? "" : "must come in through lecalib/math/eigen.hpp";
  }
  if (include.target == "libusb.h") {
    return file.path.string().rfind("lecalib/usb/libusb_", 0) == 0 ? ""
                                                                   : "must come in through lecalib/usb/transport.hpp";
  }
  if (!is_host(room) && kFreestandingEnough.count(include.target) == 0) return "does not belong on a microcontroller";
  return {};
}

}  // namespace

TEST_CASE("house: includes follow the layers") {
  std::size_t checked = 0;
  for (const SourceFile& file : lecalib::test::source_files("lecalib")) {
    INFO(file.path.string());
    REQUIRE_MESSAGE(kMayInclude.count(file.room()) == 1, "a room that the layers do not know");
    for (const Include& include : includes_of(file)) {
      const std::string why_not = objection(file, include);
      CHECK_MESSAGE(why_not.empty(), include.target << " " << why_not);
      ++checked;
    }
  }
  CHECK(checked > 10);
}

TEST_CASE("house: the layer check objects to what it should") {
  const auto objects = [](const char* path, const char* line) {
    const SourceFile file = lecalib::test::parse_source(path, line);
    REQUIRE(includes_of(file).size() == 1);
    return !objection(file, includes_of(file).front()).empty();
  };
  CHECK_FALSE(objects("lecalib/solve/a.cpp", "#include \"lecalib/math/so3.hpp\""));
  CHECK_FALSE(objects("lecalib/solve/a.cpp", "#include \"lecalib/solve/b.hpp\"  // own room"));
  CHECK(objects("lecalib/solve/a.cpp", "#include \"lecalib/match/b.hpp\""));
  CHECK(objects("lecalib/core/a.hpp", "#include \"lecalib/math/so3.hpp\""));
  CHECK(objects("lecalib/pipeline/a.cpp", "#include \"lecalib/host/b.hpp\""));
  CHECK(objects("lecalib/solve/a.cpp", "#include \"b.hpp\""));
  CHECK(objects("lecalib/solve/a.cpp", "#include <Eigen/Dense>"));
  CHECK(objects("lecalib/host/a.cpp", "#include <Eigen/Dense>"));
  CHECK(objects("lecalib/events/a.cpp", "#include <vector>"));
  CHECK_FALSE(objects("lecalib/host/a.cpp", "#include <vector>"));
  CHECK(objects("lecalib/host/a.cpp", "#include \"lecalib/usb/b.hpp\""));
  CHECK(objects("lecalib/usb/camera.cpp", "#include <libusb.h>"));
  CHECK_FALSE(objects("lecalib/usb/libusb_stream.cpp", "#include <libusb.h>"));
  CHECK_FALSE(objects("lecalib/usb/libusb_transport.cpp", "#include <libusb.h>"));
}
