// SPDX-License-Identifier: MIT
/// lecalib record: what a live camera sends, as a RAW file.
#include <cinttypes>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "camera_stream.hpp"
#include "commands.hpp"
#include "lecalib/host/file_io.hpp"

namespace lecalib::command {
namespace {

struct RecordOptions {
  std::string out;
  CameraOptions camera;
};

/// "walk.raw", then "walk-2.raw" ...: a camera that was plugged in anew begins its clock anew.
std::string part_path(const std::string& path, int part) {
  if (part == 0 || host::is_written_directly(path)) return path;
  const std::filesystem::path whole(path);
  const std::string name = whole.stem().string() + "-" + std::to_string(part + 1) + whole.extension().string();
  return (whole.parent_path() / name).string();
}

void begin_file(const std::string& path, const usb::Camera& camera, std::optional<host::OutputFile>* file) {
  file->emplace(take(host::OutputFile::create_growing(path, camera.word_bytes())));
  check((*file)->write(camera.file_header()));
}

void report(const RecordOptions& options, const CameraStream& stream) {
  std::FILE* const to = host::is_written_directly(options.out) ? stderr : stdout;
  const double seconds = stream.elapsed_s();
  const double rate = seconds > 0 ? 1e-6 * static_cast<double>(stream.bytes()) / seconds : 0;
  std::fprintf(to, "%" PRIu64 " bytes in %.1f s (%.1f MB/s) written to %s\n", stream.bytes(), seconds, rate,
               options.out.c_str());
  std::fputs(stream.losses().c_str(), to);
}

void run_record(const RecordOptions& options) {
  (void)options.camera.settings();  // words that cannot be read are said before the camera is touched
  CameraStream stream(options.camera);
  std::optional<host::OutputFile> file;
  begin_file(options.out, stream.camera(), &file);
  int part = 0;
  Progress progress("recording");
  while (true) {
    const Span<const std::uint8_t> bytes = stream.read().bytes;
    if (bytes.empty()) break;
    if (stream.restarts() != part) {
      check(file->commit());
      part = stream.restarts();
      begin_file(part_path(options.out, part), stream.camera(), &file);
    }
    check(file->write({reinterpret_cast<const char*>(bytes.data()), bytes.size()}));
    stream.show(&progress, "");
  }
  check(file->commit());
  report(options, stream);
  if (!stream.fault().empty()) fail({stream.fault() + ": " + options.out + " holds what came before"});
  if (stream.bytes() == 0) fail({"the camera sent nothing"});
}

}  // namespace

void add_record(CLI::App& app) {
  CLI::App* command = app.add_subcommand("record", "Record a live camera");
  const auto options = std::make_shared<RecordOptions>();
  command->footer(
      "The file grows while it is written: whatever ends the program, what is there can be opened. A camera that is\n"
      "plugged in anew (--reconnect) begins its clock anew, and a further file: OUT-2.raw.");
  command->add_option("OUT", options->out, "RAW file (EVT3) to write; one that exists is replaced at once")
      ->type_name("FILE")
      ->required();
  add_camera_options(command, &options->camera);
  command->callback([options] { run_record(*options); });
}

}  // namespace lecalib::command
